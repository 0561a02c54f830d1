// A path that drops IP fragments, and policies and thetas of several frames.
#include <fmt/format.h>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::seconds;

/// A policy of 64 Gaussians is 20 frames, and a theta of theirs is two.
const std::string kLarge = "policy.components=[32, 64]";

class FragmentsTest : public NetworkTest {
 protected:
  void expect_learnt_without_fragments(int percent_lost) {
    const std::filesystem::path study = service_.study(synthetic_study(16, 50));
    Network network(2);
    network.drop_fragments();
    network.send_datagram(4000);
    EXPECT_TRUE(eventually(seconds(10), [&] { return network.num_fragments() == 3; }))
        << "the path drops them";
    network.lose(percent_lost);
    const auto far = worker(network, 1, 2);
    const auto near = learner(network, 0, study, "state", {"--set", kLarge});
    const Service::Learnt learnt = expect_learnt(*near, "state", learnt_alone(study, {kLarge}));
    EXPECT_EQ(network.num_fragments(), 3) << "no message is one";
    EXPECT_EQ(learnt.log.find("messages not sent"), std::string::npos) << learnt.log;
    EXPECT_EQ(far->standard_error().find("could not be sent"), std::string::npos);
    EXPECT_GE(num_evaluated(*far), 30 * 16);
    if (learnt.status == 0) {
      fmt::print("{} % lost: {:.1f} s\n", percent_lost, learnt.summary["seconds"].get<double>());
    }
  }
};

TEST_F(FragmentsTest, LargePoliciesAreLearntWhereFragmentsAreDropped) {
  expect_learnt_without_fragments(0);
}

TEST_F(FragmentsTest, AlsoWhereAThirdOfThePacketsIsLost) { expect_learnt_without_fragments(30); }

}  // namespace
}  // namespace treeroll::end_to_end
