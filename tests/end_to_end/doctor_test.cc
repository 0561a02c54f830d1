// treeroll-doctor on networks that are well and on some that are not.
#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::seconds;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class DoctorTest : public NetworkTest {
 protected:
  /// @return the status; what was printed goes to `said`
  int ask(const Network& network, int host, std::string& said) const {
    Daemon doctor("treeroll-doctor", {"--lcm-url", Network::url(), "--seconds", "2"},
                  service_.directory(), {}, network.host(host));
    const int status = doctor.wait(seconds(30));
    said = doctor.standard_output();
    return status;
  }
};

TEST_F(DoctorTest, FindsAWorkerThatHearsAndOneThatIsDeaf) {
  const Network network(3);
  const auto near = worker(network, 1, 1);
  const auto far = worker(network, 2, 1);
  std::string said;
  EXPECT_EQ(ask(network, 0, said), 0) << said;
  EXPECT_THAT(said, HasSubstr("our messages come back"));
  EXPECT_THAT(said, ContainsRegex("messages of 1[0-9]{3} bytes come back"));
  EXPECT_THAT(said, HasSubstr("2 workers with 2 evaluators"));
  EXPECT_THAT(said, Not(HasSubstr("trouble")));

  network.deafen(2);
  EXPECT_EQ(ask(network, 0, said), 1) << said;
  EXPECT_THAT(said, HasSubstr("is heard and does not hear this host"));
  EXPECT_THAT(said, HasSubstr("hears this host and is heard"));
}

TEST_F(DoctorTest, LeavesAStudyAsItIs) {
  const auto study = service_.study(sleeping_study(200, 2000));
  const Network network(2);
  const auto busy = worker(network, 1, 2);
  const auto learning = learner(network, 0, study, "state");
  ASSERT_TRUE(journal_grows(state("state"), 5'000));
  std::string said;
  ask(network, 1, said);
  EXPECT_THAT(said, HasSubstr("runs done, 1 worker"));
  expect_learnt(*learning, "state", learnt_alone(study, kAtOnce));
}

}  // namespace
}  // namespace treeroll::end_to_end
