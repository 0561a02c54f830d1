// What a study leaves and says of what was learnt, what it was worth, and what went wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "learner/results/study_results.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::seconds;
using ::testing::HasSubstr;

fs::path study_file(const std::string& name) {
  return fs::path(TREEROLL_WORTH_DIR) / (name + ".toml");
}

struct Ended {
  int status = -1;
  std::string output;
  std::string log;
  fs::path state;
};

Ended learn(const Service& service, const fs::path& study, std::vector<std::string> more = {}) {
  Ended ended;
  ended.state = service.directory() / "state";
  std::vector<std::string> arguments = {study.string(),      "--local-workers", "2",
                                        "--lcm-url",         service.url(),     "--state-dir",
                                        ended.state.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Daemon learner("treeroll-learner", arguments, service.directory());
  ended.status = learner.wait(seconds(120));
  ended.output = learner.standard_output();
  ended.log = learner.standard_error();
  return ended;
}

std::string run_beside(const Service& service, const std::string& program,
                       const std::vector<std::string>& arguments) {
  Daemon process(program, arguments, service.directory());
  EXPECT_EQ(process.wait(seconds(120)), 0) << process.standard_error();
  return process.standard_output();
}

std::string report_of(const Service& service, const fs::path& state) {
  const fs::path report = service.directory() / "report";
  run_beside(service, "treeroll-report", {state.string(), "--output", report.string()});
  return read_file(report / "report.md");
}

TEST(WorthTest, AStudyWithoutAPositiveRewardSaysSoAndHasAStatusOfItsOwn) {
  const Service service;
  const Ended ended = learn(service, study_file("all_zero"));
  EXPECT_EQ(ended.status, 4) << ended.log;
  EXPECT_THAT(ended.log, HasSubstr("nothing was learnt: none of 600 roll-outs had a positive"));
  EXPECT_THAT(ended.output, HasSubstr("tree: no roll-out of 600 had a positive reward"));
  EXPECT_THAT(report_of(service, ended.state), HasSubstr("no roll-out of 600 had a positive"));
  run_beside(service, "treeroll-replay", {ended.state.string(), "--verify"});
}

TEST(WorthTest, TheHelpNamesEachExitStatus) {
  const Service service;
  EXPECT_THAT(run_beside(service, "treeroll-learner", {"--help"}),
              testing::AllOf(HasSubstr("Exit status: 0 done"), HasSubstr("4 done, but no")));
}

TEST(WorthTest, AStudyInWhichEveryRolloutFailsSaysWhyEverywhere) {
  const Service service;
  const Ended ended = learn(service, study_file("noisy"),
                            {"--set", "task.fail_fraction=1.0", "--set", "study.rollouts=20",
                             "--set", "study.repetitions=2"});
  EXPECT_EQ(ended.status, 4) << ended.log;
  const std::string reason = "failed: its policy is one of fail_fraction";
  // Which are among the first ten lines of their kind is a matter of time.
  EXPECT_THAT(ended.log, testing::ContainsRegex("run [01] [(]c, repetition [01][)], roll-out "
                                                "[0-9]+: " +
                                                reason));
  EXPECT_THAT(ended.log, HasSubstr("all 40 roll-outs failed, the last: c, repetition 1, roll-out "
                                   "19: " +
                                   reason));
  EXPECT_THAT(read_file(ended.state / "rollouts.csv"),
              HasSubstr("c,1,1,19,1,0,failed,its policy is one of fail_fraction\n"));
  EXPECT_THAT(read_file(ended.state / "runs.csv"), HasSubstr(",roll-out 19: " + reason + "\n"));
  EXPECT_THAT(report_of(service, ended.state),
              HasSubstr("roll-out 19: failed: its policy is one of fail"));
}

TEST(WorthTest, OnANoisyTaskTheMeanPolicyIsRecommendedAndValuedOverSeveralSeeds) {
  const Service service;
  const Ended ended =
      learn(service, study_file("noisy"),
            {"--set", "study.final_evaluations=30", "--set", "study.repetitions=4", "--json"});
  ASSERT_EQ(ended.status, 0) << ended.log;
  const json condition = json::parse(ended.output)["conditions"][0];
  EXPECT_FALSE(condition["deterministic"].get<bool>());
  const json recommended = condition["recommended"];
  ASSERT_TRUE(recommended["final"].get<bool>()) << condition;
  EXPECT_EQ(recommended["evaluations"], 30);
  const double low = recommended["interval_95"][0];
  const double high = recommended["interval_95"][1];
  // What the policy is worth without noise lies where the interval says, or next to it; the best
  // roll-outs' rewards are luck.
  const fs::path policy = ended.state / recommended["file"].get<std::string>();
  const json worth = json::parse(run_beside(service, "treeroll-evaluate",
                                            {policy.string(), study_file("noisy").string(), "--set",
                                             "task.noise_deviation=0.0", "--json"}));
  EXPECT_GT(worth["reward"], low - (high - low));
  EXPECT_LT(worth["reward"], high + (high - low));
  EXPECT_GT(condition["mean_best_reward"], worth["reward"].get<double>() + .05);
  EXPECT_EQ(worth["policy_is"], "final mean policy");
  EXPECT_TRUE(fs::exists(worth["beside"].get<std::string>()));

  for (const RunRecord& run : read_study_results(ended.state).runs) {
    EXPECT_EQ(run.finals.size(), 30U);
    EXPECT_NE(run.final_policy, run.best_policy);
    EXPECT_NE(run.final_policy, "");
  }
  const std::string report = report_of(service, ended.state);
  EXPECT_THAT(report, HasSubstr(recommended["file"].get<std::string>()));
  const std::string said =
      run_beside(service, "treeroll-evaluate",
                 {policy.string(), study_file("noisy").string(), "--evaluations", "10"});
  EXPECT_THAT(said, HasSubstr(", the final mean policy; the best roll-out is "));
  EXPECT_THAT(said, HasSubstr("], the mean of 10 evaluations\nstatus  ok\n"));
  EXPECT_THAT(run_beside(service, "treeroll-replay", {ended.state.string(), "--verify"}),
              HasSubstr("files agree"));
}

TEST(WorthTest, TheStartIsValuedAndARunThatNeverBeatsItSaysSo) {
  const Service service;
  const Ended ended = learn(service, study_file("bold_start"));
  ASSERT_EQ(ended.status, 0) << ended.log;
  int num_not_better = 0;
  for (const RunRecord& run : read_study_results(ended.state).runs) {
    ASSERT_TRUE(run.start && run.start->is_ok());
    EXPECT_NEAR(run.start->reward(), .391, .02);
    const bool is_better =
        std::max(run.best_reward, run.final_reward.value()) > run.start->reward();
    num_not_better += is_better ? 0 : 1;
    const std::string said = "run " + std::to_string(run.run) + " (tree, repetition " +
                             std::to_string(run.repetition) + ") never beats its start policy";
    EXPECT_EQ(ended.log.find(said) == std::string::npos, is_better) << said << "\n" << ended.log;
  }
  EXPECT_GT(num_not_better, 0) << "this study is to show it";
  const std::string remark = std::to_string(num_not_better) + " of 4 runs never beat the start";
  EXPECT_THAT(ended.output, HasSubstr(remark));
  EXPECT_THAT(report_of(service, ended.state), HasSubstr(remark));
}

TEST(WorthTest, DiscardedTrialsAreMadeAgainAndLeaveTheResultsAsTheyWere) {
  const Service calm;
  const Service service;
  const std::vector<std::string> few = {"--set", "study.rollouts=40",
                                        "--set", "study.repetitions=3",
                                        "--set", "task.noise_deviation=0.0"};
  std::vector<std::string> discarding = few;
  discarding.insert(discarding.end(),
                    {"--set", "task.discard_fraction=0.2", "--set", "study.in_flight=2"});
  std::vector<std::string> not_discarding = few;
  not_discarding.insert(not_discarding.end(), {"--set", "study.in_flight=2"});
  const Ended without = learn(calm, study_file("noisy"), not_discarding);
  const Ended with = learn(service, study_file("noisy"), discarding);
  ASSERT_EQ(with.status, 0) << with.log;
  EXPECT_EQ(read_file(with.state / "rollouts.csv"), read_file(without.state / "rollouts.csv"));
  EXPECT_THAT(with.output, HasSubstr(" trials were discarded and made again"));
  EXPECT_THAT(run_beside(service, "treeroll-replay", {with.state.string(), "--verify"}),
              HasSubstr("discarded  "));
}

TEST(WorthTest, OneDiscardTooManyEndsARunWithAWord) {
  const Service service;
  const Ended ended = learn(service, study_file("noisy"),
                            {"--set", "task.discard_fraction=0.3", "--set", "study.discards_max=1",
                             "--set", "study.rollouts=200", "--set", "study.repetitions=2"});
  EXPECT_EQ(ended.status, 0) << ended.log;
  EXPECT_THAT(ended.log, HasSubstr("more than 1 of its trials are void, which ends the run"));
  EXPECT_THAT(ended.output, HasSubstr("a run has ended early"));
  EXPECT_THAT(run_beside(service, "treeroll-replay", {ended.state.string(), "--verify"}),
              HasSubstr("files agree"));
  EXPECT_THAT(report_of(service, ended.state), HasSubstr("a run has ended early"));
}

}  // namespace
}  // namespace treeroll::end_to_end
