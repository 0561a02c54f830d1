// What a study's end says besides its table.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "learner/results/summary.h"
#include "tests/results/records.h"

namespace treeroll {
namespace {

using report_test::run_with;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A run that has ended: the start's reward, its roll-outs', the final policy's.
RunRecord ended(int repetition, double start, const std::vector<double>& rewards,
                const std::vector<double>& finals) {
  RunRecord run = run_with("tree", repetition, repetition, rewards);
  run.best_policy = "{}";
  run.final_policy = "{}";
  run.start = Outcome::ok(start);
  for (const double reward : finals) run.finals.push_back(Outcome::ok(reward));
  run.final_reward = mean_reward(run.finals);
  return run;
}

std::vector<std::string> said_of(const std::vector<RunRecord>& runs,
                                 const Determinism& known = {}) {
  return remarks(summarize(runs, known).at(0));
}

TEST(RemarksTest, TheBestPolicyIsTakenWhereRewardsAreCertain) {
  EXPECT_THAT(said_of({ended(0, .1, {.2, .5}, {.4}), ended(1, .1, {.7}, {.6})}),
              ElementsAre("tree: take policies/tree-1.json, the best roll-out of repetition 1: "
                          "reward 0.700"));
  EXPECT_THAT(said_of({ended(0, .1, {.2, .5}, {.4}), ended(1, .1, {.7}, {.8})}),
              ElementsAre("tree: take policies/tree-1.final.json, the final mean policy of "
                          "repetition 1: reward 0.800"));
}

TEST(RemarksTest, TheMeanPolicyIsTakenWhereTheTaskIsNoisyHoweverHighTheBest) {
  const std::vector<RunRecord> runs = {ended(0, .1, {.95}, {.25, .35, .3}),
                                       ended(1, .1, {.99}, {.2, .2, .2})};
  const std::vector<std::string> said = said_of(runs);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_THAT(said[0], HasSubstr("take policies/tree-0.final.json, the final mean policy of "
                                 "repetition 0: reward 0.300 [0.176, 0.424] over 3 evaluations"));
  EXPECT_THAT(said[0], HasSubstr("is luck"));
  // One evaluation each shows no noise: the task says it.
  const std::vector<RunRecord> once = {ended(0, .1, {.95}, {.3})};
  EXPECT_THAT(said_of(once)[0], HasSubstr("take policies/tree-0.json"));
  EXPECT_THAT(said_of(once, {{"tree", false}})[0], HasSubstr("take policies/tree-0.final.json"));
  EXPECT_THAT(said_of(once, {{"tree", false}})[0],
              HasSubstr("study.final_evaluations = 20 says more"));
}

TEST(RemarksTest, TheIntervalOfOneRunIsSaidToBeOfItsPolicyAlone) {
  const RunRecord run = ended(0, .1, {.5}, {.4, .6, .5});
  EXPECT_THAT(said_of({run}), Contains(HasSubstr("over the evaluations of its policy")));
  EXPECT_THAT(said_of({run, ended(1, .1, {.5}, {.4, .6, .5})}),
              Not(Contains(HasSubstr("over the evaluations of its policy"))));
  EXPECT_THAT(said_of({ended(0, .1, {.5}, {.4})}), Not(Contains(HasSubstr("of one run"))));
}

TEST(RemarksTest, StartsOfOneConditionThatDifferShowANoisyTask) {
  EXPECT_TRUE(summarize({ended(0, .1, {.5}, {.4}), ended(1, .1, {.5}, {.4})})[0].is_deterministic);
  const std::vector<RunRecord> differ = {ended(0, .1, {.5}, {.4}), ended(1, .2, {.5}, {.4})};
  EXPECT_FALSE(summarize(differ)[0].is_deterministic);
  // Two numeric classes differ in a last bit: what the task says of itself decides.
  EXPECT_TRUE(summarize(differ, {{"tree", true}})[0].is_deterministic);
  // A start that crashed on one host says nothing of the others.
  std::vector<RunRecord> crashed = {ended(0, .1, {.5}, {.4}), ended(1, .1, {.5}, {.4})};
  crashed[1].start = Outcome::failed(RolloutStatus::kCrashed);
  EXPECT_TRUE(summarize(crashed)[0].is_deterministic);
}

TEST(RemarksTest, ARunThatNeverBeatsItsStartIsCounted) {
  const std::vector<RunRecord> runs = {ended(0, .391, {.33, .1}, {.2}),
                                       ended(1, .391, {.391}, {.391}), ended(2, .391, {.4}, {.1}),
                                       ended(3, .391, {.1}, {.4})};
  EXPECT_THAT(said_of(runs),
              Contains("tree: 2 of 4 runs never beat the start policy, whose reward is 0.391"));
  // On a noisy task a best roll-out proves nothing, and the start's reward is that of all runs.
  EXPECT_THAT(said_of({ended(0, .1, {.9}, {.2}), ended(1, .5, {.9}, {.4})}),
              Contains("tree: 1 of 2 runs never beat the start policy, whose reward is 0.300"));
}

TEST(RemarksTest, AStartThatFailsNowAndThenIsWorthLessThanWhereItDoesNot) {
  std::vector<RunRecord> runs;
  for (int i = 0; i < 4; ++i) runs.push_back(ended(i, .7, {.9}, {.7, 0, .7, 0}));
  for (const int i : {0, 1}) runs[i].start = Outcome::failed(RolloutStatus::kFailed);
  runs[2].start = Outcome::discarded("nobody came");
  const ConditionSummary one = summarize(runs, {{"tree", false}}).at(0);
  EXPECT_DOUBLE_EQ(one.mean_start_reward.value(), .7 / 3);
  EXPECT_EQ(one.num_not_beating_start, 0) << "the final policies are worth .35";
  for (const int i : {2, 3}) runs[i].start = Outcome::failed(RolloutStatus::kFailed);
  EXPECT_EQ(summarize(runs, {{"tree", false}}).at(0).mean_start_reward, 0);
}

TEST(RemarksTest, FailuresAreCountedByTheirKindWithTheLastReason) {
  RunRecord run = ended(0, .1, {.5, 0, 0, 0, .4}, {.4});
  for (const int i : {1, 2}) run.rollouts[i].status = RolloutStatus::kDiverged;
  run.rollouts[3].status = RolloutStatus::kTimedOut;
  run.rollouts[3].reason = file_reason(run.reasons, "took more than 2 s");
  run.num_discarded = 4;
  const std::vector<std::string> said = said_of({run});
  EXPECT_THAT(said, Contains("tree: 3 of 5 roll-outs failed: 2 diverged, 1 timed_out; the last: "
                             "repetition 0, roll-out 3: timed_out: took more than 2 s"));
  EXPECT_THAT(said, Contains("tree: 4 trials were discarded and made again"));
}

TEST(RemarksTest, AStudyWithoutAPositiveRewardHasLearntNothing) {
  const std::vector<RunRecord> zero = {ended(0, 0, {0, 0}, {0})};
  EXPECT_THAT(said_of(zero), Contains(HasSubstr("no roll-out of 2 had a positive reward")));
  EXPECT_THAT(said_of(zero), Not(Contains(HasSubstr("take"))));
  EXPECT_THAT(why_nothing_was_learnt(summarize(zero)),
              HasSubstr("none of 2 roll-outs had a positive reward"));
  RunRecord failed = zero[0];
  for (RolloutRecord& rollout : failed.rollouts) rollout.status = RolloutStatus::kCrashed;
  EXPECT_EQ(why_nothing_was_learnt(summarize({failed})),
            "all 2 roll-outs failed, the last: tree, repetition 0, roll-out 1: crashed");
  EXPECT_THAT(why_nothing_was_learnt(summarize({ended(0, 0, {0, 1e-300}, {0})})), IsEmpty());
  EXPECT_THAT(why_nothing_was_learnt(summarize({run_with("tree", 0, 0, {})})), IsEmpty());
}

TEST(RemarksTest, TinyRewardsAreShownWithTheirDigits) {
  const std::string table = to_table(summarize({ended(0, 1.234e-7, {2.5e-6}, {2e-6})}));
  for (const char* digits : {"1.23e-07", "2.5e-06", "2e-06"}) {
    EXPECT_THAT(table, HasSubstr(digits));
  }
  EXPECT_THAT(table, Not(HasSubstr("0.000")));
}

}  // namespace
}  // namespace treeroll
