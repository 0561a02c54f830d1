#include "learner/results/study_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "learner/results/csv.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"
#include "tests/files/scratch_folder.h"
#include "tests/results/records.h"

namespace treeroll {
namespace {

using report_test::run_with;
using testing::HasSubstr;

class StudyResultsTest : public testing::Test {
 protected:
  void write(const std::string& name, std::string_view text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void write_results(const std::vector<RunRecord>& runs) const {
    write_runs_csv(folder_ / "runs.csv", runs);
    write_rollouts_csv(folder_ / "rollouts.csv", runs);
  }
  std::string error() const {
    try {
      (void)read_study_results(folder_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "read without an error";
  }

  static constexpr const char* kRuns =
      "condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,"
      "switches\n";
  static constexpr const char* kRollouts = "condition,repetition,run,rollout,layer,reward,status\n";
  ScratchFolder scratch_;
  std::filesystem::path folder_ = scratch_.path();
};

/// A run with all that a run can have.
RunRecord eventful_run() {
  RunRecord run = run_with("noisy", 0, 0, {.5, 0, 0, .25});
  run.rollouts[1].status = RolloutStatus::kDiverged;
  run.rollouts[1].reason = file_reason(run.reasons, "a rate, \"phi1\", is not finite");
  run.rollouts[2].status = RolloutStatus::kFailed;
  run.start = Outcome::ok(.125);
  run.finals = {Outcome::ok(.5), Outcome::failed(RolloutStatus::kTimedOut, "slow"),
                Outcome::discarded(), Outcome::ok(1. / 3)};
  run.final_reward = mean_reward(run.finals);
  run.num_discarded = 7;
  return run;
}

RunRecord tree_run(int repetition, int run) {
  RunRecord record = run_with("tree, \"deep\"", repetition, run, {.25, .5, .125, 1. / 3, .4});
  for (const std::size_t late : {2, 3}) record.rollouts[late].layer = 2;
  record.rollouts[4].layer = 3;
  record.rollouts[2].status = RolloutStatus::kDiverged;
  record.switches = {1, 3};
  record.final_reward = .1 + .2;
  return record;
}

/// An extension goes on with runs that had ended.
TEST_F(StudyResultsTest, TheFinalPolicyOfASmallerStudyDoesNotStay) {
  RunRecord run = tree_run(0, 0);
  run.best_policy = run.final_policy = "{}";
  treeroll::write_results(folder_, {run});
  ASSERT_TRUE(std::filesystem::exists(folder_ / final_policy_file(run)));
  run.final_reward.reset();
  treeroll::write_results(folder_, {run});
  EXPECT_FALSE(std::filesystem::exists(folder_ / final_policy_file(run)));
  EXPECT_TRUE(std::filesystem::exists(folder_ / best_policy_file(run)));
}

TEST_F(StudyResultsTest, WhatTheLearnerWroteIsReadBackToTheBit) {
  const std::vector<RunRecord> written = {tree_run(0, 0), tree_run(1, 1),
                                          run_with("flat", 0, 2, {0}), run_with("flat", 1, 3, {})};
  write_results(written);
  std::filesystem::create_directory(folder_ / "policies");
  write("policies/flat-0.json", "{}");
  const StudyResults results = read_study_results(folder_);
  ASSERT_EQ(results.runs.size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    const RunRecord& run = results.runs[i];
    EXPECT_EQ(run.condition, written[i].condition);
    EXPECT_EQ(run.repetition, written[i].repetition);
    EXPECT_EQ(run.best_rollout, written[i].best_rollout);
    EXPECT_EQ(run.best_reward, written[i].best_reward);
    EXPECT_EQ(run.final_reward, written[i].final_reward);
    EXPECT_EQ(run.switches, written[i].switches);
    ASSERT_EQ(run.rollouts.size(), written[i].rollouts.size());
    for (std::size_t k = 0; k < run.rollouts.size(); ++k) {
      EXPECT_EQ(run.rollouts[k].reward, written[i].rollouts[k].reward);
      EXPECT_EQ(run.rollouts[k].layer, written[i].rollouts[k].layer);
      EXPECT_EQ(run.rollouts[k].status, written[i].rollouts[k].status);
    }
  }
  EXPECT_EQ(results.runs[2].best_policy, "{}");
  EXPECT_EQ(results.runs[0].best_policy, "");
}

TEST_F(StudyResultsTest, FailuresEvaluationsAndPoliciesAreReadBack) {
  RunRecord given_up = run_with("noisy", 1, 1, {0});
  given_up.rollouts[0].status = RolloutStatus::kDiscarded;
  given_up.start = Outcome::discarded();
  write_results({eventful_run(), given_up});
  std::filesystem::create_directory(folder_ / "policies");
  write("policies/noisy-0.final.json", "{}");
  const std::vector<RunRecord> runs = read_study_results(folder_).runs;
  EXPECT_EQ(runs[0].start, Outcome::ok(.125));
  EXPECT_EQ(runs[0].final_reward, eventful_run().final_reward);
  ASSERT_EQ(runs[0].finals.size(), 4U);
  EXPECT_TRUE(runs[0].finals[1].agrees_with(Outcome::failed(RolloutStatus::kTimedOut)));
  EXPECT_TRUE(runs[0].finals[2].is_discarded());
  EXPECT_EQ(runs[0].finals[3], Outcome::ok(1. / 3));
  EXPECT_EQ(runs[0].num_discarded, 7);
  EXPECT_EQ(reason_of(runs[0], runs[0].rollouts[1]), "a rate, \"phi1\", is not finite");
  EXPECT_EQ(last_failure(runs[0]), "roll-out 2: failed");
  EXPECT_EQ(runs[0].final_policy, "{}");
  EXPECT_EQ(runs[0].best_policy, "");
  EXPECT_TRUE(runs[1].start->is_discarded());
}

TEST_F(StudyResultsTest, WhatRunsCsvSaysOfFailuresMustBeWhatTheRolloutsAddUpTo) {
  write_results({eventful_run()});
  const std::string runs = read_whole_file(folder_ / "runs.csv");
  const struct {
    const char* from;
    const char* to;
    const char* error;
  } cases[] = {
      {",1,1,0,0,0,7,", ",2,0,0,0,0,7,", "runs.csv:2: diverged = 2: must be 1, as in rollouts.csv"},
      {"roll-out 2: failed", "roll-out 3: failed", "last_failure = roll-out 3: failed: must be"},
      {",ok,0.5;", ",ok,0.6;", "must be what final_reward is the mean of"},
      {",ok,0.5;", ",fine,0.5;", "start_status = fine: must be ok, diverged"},
      {";timed_out;", ";late;", "must be ok, diverged, failed"},
      {",7,", ",-7,", "discarded = -7: must be a whole number"},
  };
  for (const auto& [from, to, expected] : cases) {
    std::string broken = runs;
    ASSERT_NE(broken.find(from), std::string::npos) << from << " in " << runs;
    broken.replace(broken.find(from), std::string_view(from).size(), to);
    write("runs.csv", broken);
    EXPECT_THAT(error(), HasSubstr(expected)) << from;
  }
}

TEST_F(StudyResultsTest, WithSeveralInFlightSwitchesAreWhereRunsCsvPutsThem) {
  RunRecord run = run_with("tree", 0, 0, {.1, .2, .3, .4, .5, .6, .7, .8});
  for (const std::size_t late : {4, 5, 6}) run.rollouts[late].layer = 2;  // three in flight
  run.rollouts[7].layer = 3;
  run.switches = {0, 6};  // a straggler, then none
  write_results({run});
  EXPECT_EQ(read_study_results(folder_).runs[0].switches, run.switches);
}

TEST_F(StudyResultsTest, ASwitchAfterWhichNothingWasDrawnCountsToo) {
  RunRecord run = run_with("tree", 0, 0, {.1, .2});
  run.switches = {1};
  write_results({run});
  EXPECT_EQ(read_study_results(folder_).runs[0].switches, std::vector<int>{1});
}

TEST_F(StudyResultsTest, GapsOfArrivalOrderStayGaps) {
  RunRecord run = run_with("flat", 0, 0, {.1, .2, .3});
  run.rollouts[1] = {};
  write_results({run});
  const StudyResults results = read_study_results(folder_);
  ASSERT_EQ(results.runs[0].rollouts.size(), 3U);
  EXPECT_EQ(results.runs[0].rollouts[1].layer, 0);
}

TEST_F(StudyResultsTest, AGapAtTheBeginningIsNoLayerThatWasLeft) {
  RunRecord run = run_with("tree", 0, 0, {.1, .2, .3, .4});
  run.rollouts[0] = {};
  run.rollouts[3].layer = 2;
  run.switches = {1};
  write_results({run});
  EXPECT_EQ(read_study_results(folder_).runs[0].switches, run.switches);
}

TEST_F(StudyResultsTest, LinesMayEndAsInOtherSystems) {
  write("runs.csv",
        "condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,"
        "switches\r\n\"a\",0,0,1,0.5,,,0,0\r\n");
  write("rollouts.csv",
        "condition,repetition,run,rollout,layer,reward,status\r\na,0,0,0,1,0.5,ok\r\n");
  EXPECT_EQ(read_study_results(folder_).runs[0].best_reward, .5);
}

TEST_F(StudyResultsTest, EveryRefusalNamesFileLineColumnValueAndRule) {
  const std::string runs = std::string(kRuns) + "a,0,0,2,0.5,0.5,,0,0\n";
  write("runs.csv", runs);
  const struct {
    const char* rows;
    const char* error;
  } cases[] = {
      {"a,0,0,0,1,x,ok\n", "rollouts.csv:2: reward = x: must be a finite number, not negative"},
      {"a,0,0,0,1,nan,ok\n", "reward = nan: must be a finite"},
      {"a,0,0,0,1,1e999,ok\n", "reward = 1e999: must be a finite"},
      {"a,0,0,0,1,-1,ok\n", "reward = -1: must be a finite"},
      {"a,0,0,0,1,,ok\n", "reward = : must be a finite"},
      {"a,0,0,0,0,1,ok\n", "layer = 0: must be a whole number from 1 to 32767"},
      {"a,0,0,0,1,1,fine\n",
       "status = fine: must be ok, diverged, failed, crashed, timed_out or discarded"},
      {"a,0,1,0,1,1,ok\n", "run = 1: must be a whole number from 0 to 0"},
      {"b,0,0,0,1,1,ok\n", "condition = b: run 0 is of a in runs.csv"},
      {"a,1,0,0,1,1,ok\n", "repetition = 1: run 0 is repetition 0 in runs.csv"},
      {"a,0,0,0,1,.5,ok\na,0,0,0,1,.5,ok\n", "rollouts.csv:3: rollout = 0: the roll-outs of a run"},
      {"a,0,0,99999999,1,.5,ok\n", "rollout = 99999999: must be a whole number from 0 to 1000001"},
      {"a,0,0,0,1,.5\n", "rollouts.csv:2: must have 7 fields"},
      {"a,0,0,0,1,.5,ok,\n", "rollouts.csv:2: must have 7 fields"},
      {"a,0,0,0,1,.5,ok", "rollouts.csv:2: must end with a line break: the file is cut off"},
      {"\"a,0,0,0,1,.5,ok\n", "rollouts.csv:2: a quoted field does not end"},
      {"\"a\"b,0,0,0,1,.5,ok\n", "rollouts.csv:2: a quoted field must be followed by"},
      {"\x1b[2J,0,0,0,1,.5,ok\n", "condition = ?[2J: run 0 is of a"},
      {"a,0,0,0,1,.5,ok\n", "runs.csv:2: rollouts = 2: must be 1, as in rollouts.csv"},
      {"a,0,0,0,1,.5,ok\na,0,0,1,1,0,failed\n", "failed = 0: must be 1, as in rollouts.csv"},
      {"a,0,0,0,1,.25,ok\na,0,0,1,1,0,ok\n", "best_reward = 0.5: must be 0.25, as in"},
      {"a,0,0,0,1,.5,ok\na,0,0,1,2,0,ok\n", "switches = 0: must be at least 1, as in rollouts.csv"},
  };
  for (const auto& [rows, expected] : cases) {
    write("rollouts.csv", std::string(kRollouts) + rows);
    EXPECT_THAT(error(), HasSubstr(expected)) << rows;
  }
  write("rollouts.csv", "");
  EXPECT_THAT(error(), HasSubstr("rollouts.csv:1: is empty: must begin with condition,"));
  write("rollouts.csv", runs);
  EXPECT_THAT(error(), HasSubstr("rollouts.csv:1: must have 8 fields"));
}

TEST_F(StudyResultsTest, RunsMustCountWithoutGaps) {
  write("rollouts.csv", kRollouts);
  write("runs.csv", std::string(kRuns) + "a,0,1,0,,,,0,0\n");
  EXPECT_THAT(error(), HasSubstr("runs.csv:2: run = 1: runs must count 0, 1, ..."));
  write("runs.csv", std::string(kRuns) + "a,1,0,0,,,,0,0\n");
  EXPECT_THAT(error(), HasSubstr("repetition = 1: repetitions of a condition must count"));
  write("runs.csv", std::string(kRuns) + "a,0,0,3,,,,0,1\n");
  EXPECT_THAT(error(),
              HasSubstr("rollouts_before_switch = : must be as many as there are switches, 1"));
}

TEST_F(StudyResultsTest, SwitchesMustAgreeWithTheLayersOfTheRollouts) {
  const std::string rollouts = std::string(kRollouts) +
                               "a,0,0,0,1,0.5,ok\na,0,0,1,1,0.5,ok\n"
                               "a,0,0,2,2,0.5,ok\na,0,0,3,2,0.5,ok\n";
  const auto error_of = [&](const std::string& first, const std::string& number) {
    write("rollouts.csv", rollouts);
    write("runs.csv", kRuns + ("a,0,0,4,0.5,," + first + ",0," + number + "\n"));
    return error();
  };
  EXPECT_EQ(error_of("2", "1"), "read without an error");
  EXPECT_EQ(error_of("1", "1"), "read without an error");    // two in flight
  EXPECT_EQ(error_of("1;4", "2"), "read without an error");  // the second after the last result
  EXPECT_THAT(error_of("", "0"), HasSubstr("runs.csv:2: switches = 0: must be at least 1"));
  EXPECT_THAT(error_of("1;3", "1"), HasSubstr("before_switch = 1;3: must be as many as there are"));
  EXPECT_THAT(error_of("1", "2"), HasSubstr("before_switch = 1: must be as many as there are"));
  for (const char* list : {"1;", ";1", "1;;3", "1;x", "1 ;3", "0;3", "1;100000001", ";"}) {
    EXPECT_THAT(error_of(list, "2"), HasSubstr("must be whole numbers from 1 to 100000000, ';'"))
        << list;
  }
  const std::string rule = ": must be up to a roll-out of the layer that was left, 1";
  EXPECT_THAT(error_of("3", "1"), HasSubstr("runs.csv:2: rollouts_before_switch = 3" + rule));
  EXPECT_THAT(error_of("99999999", "1"), HasSubstr("rollouts_before_switch = 99999999" + rule));
  EXPECT_THAT(error_of("2;1", "2"),
              HasSubstr("rollouts_before_switch = 1: must be up to a roll-out "
                        "of the layer that was left, 2"));
  EXPECT_THAT(error_of("1;4;4", "3"), HasSubstr("of the layer that was left, 3"));
}

TEST_F(StudyResultsTest, LayersAreGoneThroughOneByOne) {
  write("runs.csv", std::string(kRuns) + "a,0,0,2,0.5,,1,0,1\n");
  write("rollouts.csv", std::string(kRollouts) + "a,0,0,0,2,0.5,ok\na,0,0,1,1,0.5,ok\n");
  EXPECT_THAT(error(), HasSubstr("rollouts.csv:3: layer = 1: must be 2 as before, or the next"));
  write("rollouts.csv", std::string(kRollouts) + "a,0,0,0,2,0.5,ok\na,0,0,1,4,0.5,ok\n");
  EXPECT_THAT(error(), HasSubstr("rollouts.csv:3: layer = 4: must be 2 as before, or the next"));
}

TEST_F(StudyResultsTest, AConditionStandsOnceAndNamesNoOtherFolder) {
  write("rollouts.csv", kRollouts);
  write("runs.csv", std::string(kRuns) + "a,0,0,0,,,,0,0\nb,0,1,0,,,,0,0\na,0,2,0,,,,0,0\n");
  EXPECT_THAT(error(), HasSubstr("runs.csv:4: condition = a: the runs of a condition must stand"));
  write("runs.csv", std::string(kRuns) + "../../other,0,0,0,,,,0,0\n");
  EXPECT_THAT(error(), HasSubstr("runs.csv:2: condition = ../../other: must hold no slash"));
}

TEST_F(StudyResultsTest, MissingFilesAreNamed) {
  EXPECT_THAT(error(), HasSubstr((folder_ / "runs.csv").string() + ": no such file"));
}

}  // namespace
}  // namespace treeroll
