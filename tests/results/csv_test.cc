#include "learner/results/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "common/files/atomic_file.h"
#include "learner/results/run_counts.h"
#include "tests/files/scratch_folder.h"
#include "tests/results/records.h"

namespace treeroll {
namespace {

using report_test::run_with;
using testing::HasSubstr;

class CsvTest : public testing::Test {
 protected:
  static std::string content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::ptrdiff_t num_entries() const {
    return std::distance(std::filesystem::directory_iterator(folder_), {});
  }

  ScratchFolder scratch_;
  std::filesystem::path folder_ = scratch_.path();
};

TEST_F(CsvTest, RolloutsAreSortedByRunWithShortestExactNumbers) {
  RunRecord second = run_with("tree", 0, 2, {1.0 / 3, 0});
  second.rollouts[1] = {.reward = 0, .layer = 2, .status = RolloutStatus::kTimedOut};
  second.rollouts[1].reason = file_reason(second.reasons, "slow, very");
  const std::vector<RunRecord> runs = {second, run_with("flat", 1, 1, {1, 1e-5}),
                                       run_with("flat", 0, 0, {.1})};
  write_rollouts_csv(folder_ / "rollouts.csv", runs);
  EXPECT_EQ(content(folder_ / "rollouts.csv"),
            "condition,repetition,run,rollout,layer,reward,status,reason\n"
            "flat,0,0,0,1,0.1,ok,\n"
            "flat,1,1,0,1,1,ok,\n"
            "flat,1,1,1,1,1e-05,ok,\n"
            "tree,0,2,0,1,0.3333333333333333,ok,\n"
            "tree,0,2,1,2,0,timed_out,\"slow, very\"\n");
}

TEST_F(CsvTest, ARolloutWithoutAResultHasNoRowAndKeepsTheNumbersOfTheOthers) {
  RunRecord run = run_with("tree", 0, 0, {.5, .6, .7});
  run.rollouts[1] = {};
  write_rollouts_csv(folder_ / "rollouts.csv", {run});
  EXPECT_EQ(content(folder_ / "rollouts.csv"),
            "condition,repetition,run,rollout,layer,reward,status,reason\n"
            "tree,0,0,0,1,0.5,ok,\n"
            "tree,0,0,2,1,0.7,ok,\n");
}

TEST_F(CsvTest, RunsHoldEmptyFieldsForFiguresThatDoNotExist) {
  RunRecord switched = run_with("tree", 0, 1, {.25, .5, .125});
  switched.rollouts[2].status = RolloutStatus::kDiverged;
  switched.final_reward = .75;
  switched.switches = {1, 2};
  write_runs_csv(folder_ / "runs.csv", {switched, run_with("flat", 0, 0, {})});
  EXPECT_EQ(
      content(folder_ / "runs.csv"),
      "condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,"
      "switches,start_reward,start_status,final_rewards,final_low,final_high,diverged,task_failed,"
      "crashed,timed_out,given_up,discarded,last_failure\n"
      "flat,0,0,0,,,,0,0,,,,,,0,0,0,0,0,0,\n"
      "tree,0,1,3,0.5,0.75,2;3,1,2,,,,,,1,0,0,0,0,0,roll-out 2: diverged\n");
}

TEST_F(CsvTest, TheStartAndTheFinalPolicyHaveTheirRewardsAndAnInterval) {
  RunRecord run = run_with("tree", 0, 0, {.5});
  run.start = Outcome::ok(.25);
  run.finals = {Outcome::ok(.5), Outcome::failed(RolloutStatus::kDiverged), Outcome::discarded(),
                Outcome::ok(.25)};
  run.final_reward = mean_reward(run.finals);
  run.num_discarded = 3;
  write_runs_csv(folder_ / "runs.csv", {run});
  // .5, 0 and .25: mean .25, s .25, t 4.302653.
  EXPECT_THAT(content(folder_ / "runs.csv"),
              testing::ContainsRegex(",0\\.5,0\\.25,,0,0,0\\.25,ok,0\\.5;diverged;discarded;0\\.25,"
                                     "-0\\.371[0-9]+,0\\.871[0-9]+,0,0,0,0,0,3,\n$"));
}

TEST_F(CsvTest, ADiscardedStartHasNoReward) {
  RunRecord run = run_with("tree", 0, 0, {.5});
  run.start = Outcome::discarded("the arm was caught");
  write_runs_csv(folder_ / "runs.csv", {run});
  EXPECT_THAT(content(folder_ / "runs.csv"), HasSubstr(",0,0,,discarded,,,,0,0,0,0,0,0,\n"));
}

TEST_F(CsvTest, ARunKeepsABoundedNumberOfReasons) {
  RunRecord run = run_with("tree", 0, 0, std::vector<double>(300, 0));
  for (int i = 0; i < 300; ++i) {
    run.rollouts[static_cast<std::size_t>(i)].status = RolloutStatus::kFailed;
    run.rollouts[static_cast<std::size_t>(i)].reason =
        file_reason(run.reasons, "reason " + std::to_string(i % 280));
  }
  EXPECT_EQ(run.reasons.size(), static_cast<std::size_t>(kReasonsPerRunMax));
  EXPECT_EQ(reason_of(run, run.rollouts[253]), "reason 253");
  EXPECT_THAT(reason_of(run, run.rollouts[254]), HasSubstr("which the journal has"));
  EXPECT_EQ(reason_of(run, run.rollouts[285]), "reason 5");
}

TEST_F(CsvTest, ABestRewardOfZeroIsAFigure) {
  write_runs_csv(folder_ / "runs.csv", {run_with("flat", 0, 0, {0})});
  EXPECT_THAT(content(folder_ / "runs.csv"), HasSubstr("\nflat,0,0,1,0,,,0,0,,"));
}

TEST_F(CsvTest, AnOldFileIsReplacedAsAWholeAndNothingElseIsLeft) {
  write_atomically(folder_ / "runs.csv", "old and much longer than what follows");
  write_atomically(folder_ / "runs.csv", "new");
  EXPECT_EQ(content(folder_ / "runs.csv"), "new");
  EXPECT_EQ(num_entries(), 1);
}

TEST_F(CsvTest, AFileThatIsNotCommittedLeavesTheOldOne) {
  write_atomically(folder_ / "runs.csv", "old");
  { AtomicFile(folder_ / "runs.csv").append("half of a ta"); }
  EXPECT_EQ(content(folder_ / "runs.csv"), "old");
  EXPECT_EQ(num_entries(), 1);
}

TEST_F(CsvTest, AMissingFolderIsAnErrorWithPathAndReason) {
  try {
    write_runs_csv(folder_ / "none" / "runs.csv", {});
    FAIL() << "wrote into a folder that does not exist";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), "cannot write " + (folder_ / "none" / "runs.csv").string() +
                                ": No such file or directory");
  }
}

TEST_F(CsvTest, AFullDiskIsAnErrorAndLeavesNoOtherFile) {
  // What is written through this link goes to a device that is always full.
  std::filesystem::create_symlink("/dev/full", folder_ / "runs.csv");
  try {
    write_runs_csv(folder_ / "runs.csv", {});
    FAIL() << "wrote to a full disk";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("runs.csv: No space left on device"));
  }
  EXPECT_EQ(num_entries(), 1);
}

}  // namespace
}  // namespace treeroll
