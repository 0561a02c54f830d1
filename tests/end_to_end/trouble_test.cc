// Hosts are cut off, daemons and evaluators are killed and stopped, many come at once: every run
// still ends with the files that one process alone would write.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "tests/end_to_end/network_test.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

int num_said(const Daemon& daemon, const std::string& words) {
  return count_of(daemon.standard_error(), words);
}

bool says(const Daemon& daemon, const std::string& words, int times = 1) {
  return eventually(seconds(60), [&] { return num_said(daemon, words) >= times; });
}

class TroubleTest : public NetworkTest {};

TEST_F(TroubleTest, WhoIsCutOffComesBack) {
  const fs::path study = service_.study(sleeping_study(400, 2000));
  Network network(3);
  const auto first = worker(network, 1, 2);
  const auto second = worker(network, 2, 2);
  const auto cut_learner = learner(network, 0, study, "state");
  ASSERT_TRUE(says(*cut_learner, "has joined", 2));
  ASSERT_TRUE(journal_grows(state("state"), 20'000));
  network.cut(1);
  ASSERT_TRUE(says(*cut_learner, "has left", 1));
  network.heal(1);
  ASSERT_TRUE(says(*cut_learner, "has joined", 3)) << cut_learner->standard_error();
  network.cut(0);
  ASSERT_TRUE(says(*cut_learner, "has left", 3)) << cut_learner->standard_error();
  network.heal(0);
  expect_learnt(*cut_learner, "state", learnt_alone(study, kAtOnce));
}

TEST_F(TroubleTest, EvaluatorsAndWorkersAreKilledAndStopped) {
  const fs::path study = service_.study(sleeping_study(400, 2000));
  Network network(3);
  const auto steady = worker(network, 1, 2);
  const auto stopped = worker(network, 2, 1);
  const auto doomed = worker(network, 2, 1);
  const auto near = learner(network, 0, study, "state");
  ASSERT_TRUE(says(*near, "has joined", 3));
  ASSERT_TRUE(journal_grows(state("state"), 20'000));

  const std::vector<pid_t> evaluators = steady->children();
  ASSERT_EQ(evaluators.size(), 2U);
  ::kill(evaluators[0], SIGKILL);
  EXPECT_TRUE(says(*steady, "ended by signal 9"));
  ::kill(evaluators[1], SIGSTOP);
  ASSERT_TRUE(journal_grows(state("state"), 5'000));
  ::kill(evaluators[1], SIGCONT);

  doomed->kill(SIGKILL);
  stopped->kill(SIGSTOP);
  ASSERT_TRUE(says(*near, "has left", 2)) << near->standard_error();
  stopped->kill(SIGCONT);
  ASSERT_TRUE(says(*near, "has joined", 4)) << near->standard_error();

  // Last: where it is caught while it loads a policy, the study cannot end for some 16 s.
  ASSERT_TRUE(journal_grows(state("state"), 5'000));
  ::kill(evaluators[1], SIGSTOP);
  EXPECT_TRUE(says(*steady, "is killed")) << "an evaluator stays stopped for ever";
  const Service::Learnt learnt = expect_learnt(*near, "state", learnt_alone(study, kAtOnce));
  EXPECT_GT(learnt.summary["ledger"]["reissued"], 0) << "the kills met no work";
}

TEST_F(TroubleTest, AHostThatKillsEveryEvaluatorDoesNotHoldTheStudyUp) {
  const fs::path study = service_.study(sleeping_study(20, 20'000));
  Network network(3);
  const auto deadly = worker(network, 1, 2);
  const auto sound = worker(network, 2, 2);
  const auto near = learner(network, 0, study, "state");
  ASSERT_TRUE(says(*near, "has joined", 2));
  EXPECT_TRUE(eventually(seconds(60), [&] {
    for (const pid_t evaluator : deadly->children()) ::kill(evaluator, SIGKILL);
    return fs::exists(state("state") / "runs.csv");
  })) << near->standard_error();
  expect_learnt(*near, "state", learnt_alone(study, kAtOnce));
  EXPECT_TRUE(says(*deadly, "ended by signal 9")) << "nothing was killed";
}

TEST_F(TroubleTest, ALearnerIsKilledWhilePacketsAreLostAndGoesOn) {
  const fs::path study = service_.study(sleeping_study(100, 500));
  Network network(2);
  network.lose(10);
  const auto far = worker(network, 1, 2);
  auto near = learner(network, 0, study, "state");
  for (const int num_bytes : {1'000, 40'000, 70'000}) {
    ASSERT_TRUE(journal_grows(state("state"), static_cast<std::uintmax_t>(num_bytes)))
        << near->standard_error();
    near->kill(SIGKILL);
    ASSERT_EQ(near->wait(seconds(10)), 128 + SIGKILL);
    expect_verified("state");
    near = resumed(network, 0, "state");
  }
  expect_learnt(*near, "state", learnt_alone(study, kAtOnce));
  expect_verified("state");
}

TEST_F(TroubleTest, TwoLearnersShareTheWorkersOfAGroup) {
  const fs::path study = service_.study(sleeping_study(60, 1000));
  const fs::path other_study = service_.study(sleeping_study(60, 1000, 13));
  Network network(3);
  network.lose(10);
  const auto far = worker(network, 2, 2);
  const auto one = learner(network, 0, study, "one");
  const auto other = learner(network, 1, other_study, "other");
  const Files files = learnt_alone(study, kAtOnce);
  const Files other_files = learnt_alone(other_study, kAtOnce);
  EXPECT_NE(files.rollouts_csv, other_files.rollouts_csv);
  expect_learnt(*one, "one", files);
  expect_learnt(*other, "other", other_files);
  EXPECT_LE(num_evaluated(*far), 2 * (60 + 1) * 30 * 1.05);
}

TEST_F(TroubleTest, AHundredWorkersJoinAtOnce) {
  const fs::path study = service_.study(sleeping_study(40, 20'000));
  Network network(5);
  std::vector<std::unique_ptr<Daemon>> workers;
  for (int i = 0; i < 100; ++i) workers.push_back(worker(network, 1 + i % 4, 1));
  for (const auto& each : workers) ASSERT_TRUE(says(*each, "with 1 evaluators"));
  const auto near = learner(network, 0, study, "state");
  const Service::Learnt learnt = expect_learnt(*near, "state", learnt_alone(study, kAtOnce));
  EXPECT_EQ(learnt.summary["workers"].size(), 100U);
  EXPECT_EQ(num_said(*near, "has left"), 0);
}

TEST_F(TroubleTest, AFullDiskEndsTheLearnerAndWithSpaceItGoesOn) {
  const fs::path study = service_.study(sleeping_study(100, 500));
  fs::create_directory(state("disk"));
  const SmallDisk disk(state("disk").string(), 128);
  Network network(2);
  const auto far = worker(network, 1, 2);
  const auto full = learner(network, 0, study, "disk/state");
  EXPECT_EQ(full->wait(seconds(60)), 1) << full->standard_error();
  EXPECT_THAT(full->standard_error(), HasSubstr("journal.lcmlog: cannot"));
  EXPECT_THAT(full->standard_error(), HasSubstr("No space left on device"));
  expect_verified("disk/state");
  EXPECT_GT(fs::file_size(state("disk/state") / "journal.lcmlog"), 50'000U);

  const auto still_full = resumed(network, 0, "disk/state");
  EXPECT_EQ(still_full->wait(seconds(60)), 1) << still_full->standard_error();
  EXPECT_THAT(still_full->standard_error(), HasSubstr("No space left on device"));

  disk.resize(8192);
  const auto near = resumed(network, 0, "disk/state");
  expect_learnt(*near, "disk/state", learnt_alone(study, kAtOnce));
  expect_verified("disk/state");
}

}  // namespace
}  // namespace treeroll::end_to_end
