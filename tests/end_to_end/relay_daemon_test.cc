// treeroll-relay between two groups: one worker to the learner, and the same bits, whoever dies.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <string>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr const char* kBelow = "udpm://239.255.76.68:7668?ttl=1";

class RelayDaemonTest : public NetworkTest {
 protected:
  using Process = std::unique_ptr<Daemon>;

  Process start(const Network& network, int host, const std::string& program,
                const std::vector<std::string>& arguments) const {
    return std::make_unique<Daemon>(program, arguments, service_.directory(),
                                    std::map<std::string, std::string>{}, network.host(host));
  }
  Process relay(const Network& network, int host) const {
    return start(network, host, "treeroll-relay", {"--above", Network::url(), "--below", kBelow});
  }
  Process worker_below(const Network& network, int host, int processes) const {
    return start(network, host, "treeroll-worker",
                 {"--processes", std::to_string(processes), "--lcm-url", kBelow});
  }
};

TEST_F(RelayDaemonTest, ARackIsOneWorkerAndTheFilesAreTheSame) {
  const fs::path study = service_.study(synthetic_study(40, 2000));
  const Files files = learnt_alone(study, kAtOnce);
  Network network(3);
  const Process relay_process = relay(network, 1);
  const Process one = worker_below(network, 1, 2);
  const Process two = worker_below(network, 2, 1);
  const Process study_learner = learner(network, 0, study, "learnt");
  const Service::Learnt learnt = expect_learnt(*study_learner, "learnt", files);
  EXPECT_EQ(learnt.summary["workers"].size(), 1U) << learnt.summary.dump(1);
  expect_verified("learnt");
  EXPECT_GT(num_evaluated(*one), 0);
  EXPECT_GT(num_evaluated(*two), 0);
  relay_process->kill(SIGTERM);
  EXPECT_EQ(relay_process->wait(seconds(20)), 0) << relay_process->standard_error();
}

TEST_F(RelayDaemonTest, RelayWorkerAndLearnerMayBeKilled) {
  const fs::path study = service_.study(patient_study(60, 20'000));
  const Files files = learnt_alone(study, kAtOnce);
  Network network(3);
  Process relay_process = relay(network, 1);
  Process one = worker_below(network, 1, 2);
  const Process two = worker_below(network, 2, 4);
  Process study_learner = learner(network, 0, study, "learnt");
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << study_learner->standard_error();
  relay_process->kill(SIGKILL);
  relay_process = relay(network, 1);
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << study_learner->standard_error();
  one.reset();
  ASSERT_TRUE(journal_grows(state("learnt"), 5000)) << study_learner->standard_error();
  study_learner->kill(SIGKILL);
  study_learner->wait(seconds(5));
  one = worker_below(network, 1, 2);
  study_learner = resumed(network, 0, "learnt");
  expect_learnt(*study_learner, "learnt", files);
  expect_verified("learnt");
}

TEST_F(RelayDaemonTest, AWorkerBesideTheLearnerWorksAlongWithARack) {
  const fs::path study = service_.study(patient_study(30, 10'000));
  const Files files = learnt_alone(study, kAtOnce);
  Network network(3);
  const Process relay_process = relay(network, 1);
  const Process below = worker_below(network, 2, 4);
  const Process beside = worker(network, 0, 4);
  const Process study_learner = learner(network, 0, study, "learnt");
  expect_learnt(*study_learner, "learnt", files);
  EXPECT_GT(num_evaluated(*below), 0);
  EXPECT_GT(num_evaluated(*beside), 0);
}

TEST_F(RelayDaemonTest, AnOptionThatIsWrongIsRefusedWithTheReason) {
  const auto said = [&](const std::vector<std::string>& arguments) {
    const Said all = service_.run("treeroll-relay", arguments);
    EXPECT_EQ(all.status, 2);
    return all.errors;
  };
  EXPECT_THAT(said({"--above", service_.url()}), HasSubstr("--below"));
  EXPECT_THAT(said({"--above", service_.url(), "--below", service_.url()}),
              HasSubstr("the relay would hear itself"));
  EXPECT_THAT(said({"--above", "udpm://1.2.3.4:7667", "--below", service_.url()}),
              HasSubstr("must be a multicast address"));
  EXPECT_THAT(said({"--above", "memq://", "--below", service_.url()}), HasSubstr("--above"));
}

}  // namespace
}  // namespace treeroll::end_to_end
