#include "learner/report/statistics/claim.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/results/records.h"

namespace treeroll::report {
namespace {

using report_test::run_with;
using testing::HasSubstr;

/// A run of ten equal rewards, which switched after roll-out `switched` (from 1) unless that is 0.
RunRecord level(const char* condition, int repetition, double reward, int switched = 0) {
  RunRecord run = run_with(condition, repetition, 0, std::vector<double>(10, reward));
  if (switched > 0) run.switches = {switched - 1};
  run.final_reward = reward;
  return run;
}

/// "low" about .2, "same" as low, "high" about .8; three repetitions each; "wide" from 0 to 1.
std::vector<StudyResults> studies() {
  StudyResults study{.name = "study", .directory = "", .runs = {}};
  const double shifts[] = {-.02, 0, .02};
  for (int i = 0; i < 3; ++i) {
    study.runs.push_back(level("low", i, .2 + shifts[i], 8 + i % 2));
    study.runs.push_back(level("same", i, .2 + shifts[i], 6));
    study.runs.push_back(level("high", i, .8 + shifts[i], 5));
    study.runs.push_back(level("wide", i, .5 + 25 * shifts[i]));
  }
  return {study};
}

Claim claim(ClaimKind kind, std::vector<std::string> conditions) {
  Claim claim;
  claim.kind = kind;
  claim.study = "study";
  claim.conditions = std::move(conditions);
  claim.measure = claim.against = {.kind = MeasureKind::kNear, .from = 1, .rollout = 10};
  return claim;
}

Verdict verdict(const Claim& claim) { return judge(claim, studies()).verdict; }

TEST(ClaimTest, GreaterHoldsOrNotOrIsOpen) {
  EXPECT_EQ(verdict(claim(ClaimKind::kGreater, {"high", "low"})), Verdict::kHolds);
  EXPECT_EQ(verdict(claim(ClaimKind::kGreater, {"low", "high"})), Verdict::kFails);
  EXPECT_EQ(verdict(claim(ClaimKind::kGreater, {"wide", "low"})), Verdict::kInconclusive);
}

TEST(ClaimTest, AResultHasTheFiguresItRestsOn) {
  const ClaimResult result = judge(claim(ClaimKind::kGreater, {"high", "low"}), studies());
  EXPECT_EQ(result.n, "3");
  EXPECT_LT(result.p.value(), 1e-4);
  EXPECT_GT(result.interval.value().low, .5);
  EXPECT_THAT(result.measured, HasSubstr("high 0.8, low 0.2; difference +0.6"));
}

TEST(ClaimTest, EqualityNeedsEvidenceOfItsOwn) {
  Claim equal = claim(ClaimKind::kEqualWithin, {"low", "same"});
  equal.margin = .1;
  EXPECT_EQ(verdict(equal), Verdict::kHolds);
  equal.conditions = {"low", "wide"};  // no significant difference, but no equality either
  EXPECT_EQ(verdict(equal), Verdict::kInconclusive);
  equal.conditions = {"low", "same", "high"};
  EXPECT_EQ(verdict(equal), Verdict::kFails);
}

TEST(ClaimTest, OnePairThatIsApartByChanceAmongManyDoesNotRefuteEquality) {
  const auto judged = [](double far, std::vector<std::string> conditions) {
    StudyResults study{.name = "study", .directory = "", .runs = {}};
    for (int i = 0; i < 5; ++i) {
      const double shift = .01 * (i - 2);  // Welch's standard error of a difference is .01
      study.runs.push_back(level("first", i, .5 + shift));
      study.runs.push_back(level("second", i, .518 + shift));
      study.runs.push_back(level("third", i, .518 + shift));
      study.runs.push_back(level("far", i, far + shift));
    }
    Claim equal = claim(ClaimKind::kEqualWithin, std::move(conditions));
    equal.margin = .01;
    return judge(equal, {study}).verdict;
  };
  const std::vector<std::string> all = {"first", "second", "third", "far"};
  EXPECT_EQ(judged(.536, {"first", "far"}), Verdict::kFails);  // p .03 for more than the margin
  EXPECT_EQ(judged(.536, {"far", "first"}), Verdict::kFails);
  EXPECT_EQ(judged(.532, {"first", "far"}), Verdict::kInconclusive);
  EXPECT_EQ(judged(.536, all), Verdict::kInconclusive);  // .19 over six pairs
  EXPECT_EQ(judged(.576, all), Verdict::kFails);
}

TEST(ClaimTest, HighestAndLowestAreAgainstEveryOther) {
  EXPECT_EQ(verdict(claim(ClaimKind::kHighest, {"high", "low", "same"})), Verdict::kHolds);
  EXPECT_EQ(verdict(claim(ClaimKind::kHighest, {"low", "high", "same"})), Verdict::kFails);
  EXPECT_EQ(verdict(claim(ClaimKind::kLowest, {"low", "high"})), Verdict::kHolds);
  EXPECT_EQ(verdict(claim(ClaimKind::kLowest, {"low", "high", "same"})), Verdict::kInconclusive);
}

TEST(ClaimTest, AMarginIsWhatTheFirstMustBeAheadBy) {
  Claim greater = claim(ClaimKind::kGreater, {"high", "low"});  // .6 apart
  greater.margin = .5;
  EXPECT_EQ(verdict(greater), Verdict::kHolds);
  EXPECT_THAT(judge(greater, studies()).measured, HasSubstr("difference +0.6; margin 0.5"));
  EXPECT_NEAR(judge(greater, studies()).interval.value().low, .6, .1);
  greater.margin = .7;
  EXPECT_EQ(verdict(greater), Verdict::kFails);
  for (const ClaimKind kind : {ClaimKind::kHighest, ClaimKind::kLowest}) {
    const bool highest = kind == ClaimKind::kHighest;
    Claim extreme = claim(kind, {highest ? "high" : "low", highest ? "low" : "high"});
    extreme.margin = .5;
    EXPECT_EQ(verdict(extreme), Verdict::kHolds);
    extreme.margin = .7;
    EXPECT_EQ(verdict(extreme), Verdict::kFails);
  }
}

TEST(ClaimTest, ANegativeMarginClaimsThatTheFirstIsNotFarBelow) {
  Claim not_below = claim(ClaimKind::kGreater, {"low", "same"});
  EXPECT_EQ(verdict(not_below), Verdict::kInconclusive);
  not_below.margin = -.1;
  EXPECT_EQ(verdict(not_below), Verdict::kHolds);
  not_below.conditions = {"low", "high"};
  EXPECT_EQ(verdict(not_below), Verdict::kFails);
  not_below.conditions = {"low", "wide"};
  EXPECT_EQ(verdict(not_below), Verdict::kInconclusive);
  not_below.conditions = {"low", "same"};
  not_below.paired = true;
  EXPECT_EQ(verdict(not_below), Verdict::kHolds);
}

TEST(ClaimTest, MediansAreEqualByTheirExactIntervals) {
  StudyResults study{.name = "study", .directory = "", .runs = {}};
  for (int i = 0; i < 8; ++i) {
    study.runs.push_back(level("a", i, .2, 3 + i % 2));
    study.runs.push_back(level("b", i, .2, i == 0 ? 0 : 4));  // a run that never switched is one
    study.runs.push_back(level("c", i, .2, 9));
  }
  Claim equal = claim(ClaimKind::kEqualMedians, {"a", "b"});
  equal.measure = equal.against = {.kind = MeasureKind::kSwitch};
  const auto judged = [&](std::vector<std::string> conditions, double margin) {
    equal.conditions = std::move(conditions);
    equal.margin = margin;
    return judge(equal, {study});
  };
  EXPECT_EQ(judged({"a", "b"}, 8).verdict, Verdict::kHolds);
  EXPECT_EQ(judged({"a", "b"}, .5).verdict, Verdict::kInconclusive);
  EXPECT_EQ(judged({"a", "b", "c"}, 1).verdict, Verdict::kFails);
  EXPECT_THAT(judged({"a", "c"}, 1).measured, HasSubstr("medians a 3.5, c 9; margin 1"));
  study.runs.resize(3 * 5);
  EXPECT_EQ(judged({"a", "b"}, 8).measured, "fewer than six repetitions");
}

TEST(ClaimTest, ADeviationIsOverTheRuns) {
  Claim deviation = claim(ClaimKind::kDeviation, {"wide"});  // 0, .5, 1
  deviation.low = .2;
  deviation.high = 4;
  EXPECT_EQ(verdict(deviation), Verdict::kHolds);
  deviation.low = .3;
  EXPECT_EQ(verdict(deviation), Verdict::kInconclusive);
  deviation.conditions = {"low"};
  EXPECT_EQ(verdict(deviation), Verdict::kFails);
}

TEST(ClaimTest, GainDropAndSteepestPartOfARun) {
  std::vector<double> rewards(120, .1);
  std::fill(rewards.begin() + 60, rewards.end(), .7);
  std::fill(rewards.begin() + 80, rewards.end(), .5);
  RunRecord run = run_with("a", 0, 0, rewards);
  EXPECT_NEAR(measure({run, {}}, {.kind = MeasureKind::kGain, .rollout = 120}).value(), .4, 1e-12);
  EXPECT_NEAR(measure({run, {}}, {.kind = MeasureKind::kGain, .rollout = 5}).value(), 0, 1e-12);
  EXPECT_NEAR(measure({run, {}}, {.kind = MeasureKind::kSteepest, .rollout = 120}).value(), .6,
              1e-12);
  EXPECT_NEAR(measure({run, {}}, {.kind = MeasureKind::kSteepest, .rollout = 62}).value(), .24,
              1e-12);
  EXPECT_FALSE(measure({run, {}}, {.kind = MeasureKind::kSteepest, .rollout = 54}).has_value());
  EXPECT_FALSE(measure({run, {}}, {.kind = MeasureKind::kDrop}).has_value());  // never switched
  run.switches = {79};
  EXPECT_NEAR(measure({run, {}}, {.kind = MeasureKind::kDrop}).value(), .2, 1e-12);
}

TEST(ClaimTest, ALikelihoodIsOfTheFitAndHasNoRepetitions) {
  std::vector<StudyResults> given = studies();
  Claim likelier = claim(ClaimKind::kGreater, {"high", "low"});
  likelier.measure = likelier.against = {.kind = MeasureKind::kLogLikelihood};
  EXPECT_EQ(judge(likelier, given).measured,
            "high: no run has a log-likelihood of the demonstration");
  given[0].log_likelihoods = {{"high", -3.0}, {"low", -2.9}};
  const ClaimResult result = judge(likelier, given);
  EXPECT_EQ(result.verdict, Verdict::kFails);
  EXPECT_EQ(result.n, "1");
  likelier.against = {.kind = MeasureKind::kNear, .rollout = 10};
  EXPECT_EQ(judge(likelier, given).n, "1, 3");
}

TEST(ClaimTest, FitsThatAreCountedAreOneForEachCondition) {
  StudyResults study{.name = "study", .directory = "", .runs = {}};
  for (const char* condition : {"two", "eight", "four"}) {
    for (int i = 0; i < 30; ++i) study.runs.push_back(level(condition, i, .5));
  }
  study.log_likelihoods = {{"two", -3.84}, {"eight", -2.31}, {"four", -2.96}};
  Claim fits = claim(ClaimKind::kGrowing, {"two", "eight", "four"});
  fits.measure = fits.against = {.kind = MeasureKind::kLogLikelihood};
  const auto judged = [&] { return judge(fits, {study}); };
  EXPECT_EQ(judged().verdict, Verdict::kFails);
  EXPECT_EQ(judged().p, 1);
  EXPECT_EQ(judged().n, "1");
  fits.conditions = {"two", "four", "eight"};
  EXPECT_EQ(judged().verdict, Verdict::kHolds);
  fits.kind = ClaimKind::kFalling;
  EXPECT_EQ(judged().verdict, Verdict::kFails);
  fits.conditions = {"eight", "four", "two"};
  EXPECT_EQ(judged().verdict, Verdict::kHolds);

  fits.kind = ClaimKind::kShare;
  fits.low = -3;
  fits.high = 0;
  fits.share_min = .6;
  EXPECT_EQ(judged().verdict, Verdict::kHolds);
  EXPECT_THAT(judged().measured, HasSubstr("2 of 3 in"));
  fits.share_min = .7;
  EXPECT_EQ(judged().verdict, Verdict::kFails);
}

TEST(ClaimTest, SwitchesFallOrGrowFromConditionToCondition) {
  Claim falling = claim(ClaimKind::kFalling, {"low", "same", "high"});
  falling.measure = falling.against = {.kind = MeasureKind::kSwitch};
  EXPECT_EQ(verdict(falling), Verdict::kHolds);
  falling.kind = ClaimKind::kGrowing;
  EXPECT_EQ(verdict(falling), Verdict::kFails);
}

TEST(ClaimTest, ARunThatNeverSwitchedCountsWithItsBudget) {
  EXPECT_EQ(measure({level("a", 0, .5), {}}, {.kind = MeasureKind::kSwitch}), 10);
  EXPECT_EQ(measure({level("a", 0, .5, 4), {}}, {.kind = MeasureKind::kSwitch}), 4);
}

TEST(ClaimTest, SharesAndMeansAreJudgedByTheirIntervals) {
  Claim share = claim(ClaimKind::kShare, {"low", "same"});
  share.low = .7;
  share.high = 1;
  share.share_max = .5;  // none of six: at most .459 with 97.5 %
  EXPECT_EQ(verdict(share), Verdict::kHolds);
  share.share_max = .4;
  EXPECT_EQ(verdict(share), Verdict::kInconclusive);
  share.share_max = 1;
  share.share_min = .5;
  EXPECT_EQ(verdict(share), Verdict::kFails);
  Claim within = claim(ClaimKind::kWithin, {"low"});
  within.low = .1;
  within.high = .3;
  EXPECT_EQ(verdict(within), Verdict::kHolds);
  within.low = .2;
  EXPECT_EQ(verdict(within), Verdict::kInconclusive);
  within.low = .28;
  EXPECT_EQ(verdict(within), Verdict::kFails);
}

TEST(ClaimTest, SpreadComparesTheRangeOverConditions) {
  Claim spread = claim(ClaimKind::kSpread, {"low", "high"});
  spread.others = {"low", "same"};
  EXPECT_EQ(verdict(spread), Verdict::kHolds);
}

TEST(ClaimTest, WhatIsNotThereIsNotMeasuredAndSaysWhy) {
  const auto reason = [](Claim claim) {
    const ClaimResult result = judge(claim, studies());
    EXPECT_EQ(result.verdict, Verdict::kNotMeasured);
    return result.measured;
  };
  Claim wanted = claim(ClaimKind::kGreater, {"high", "none"});
  EXPECT_EQ(reason(wanted), "study study has no condition none");
  wanted.conditions = {"high", "other:low"};
  EXPECT_EQ(reason(wanted), "study other is not among those given");
  wanted.conditions = {"high", "low"};
  wanted.measure.rollout = 11;
  EXPECT_EQ(reason(wanted), "high: no run has a reward near roll-out 11");
  wanted = claim(ClaimKind::kGreater, {"wide", "low"});
  wanted.measure = {.kind = MeasureKind::kAfterSwitch};
  EXPECT_THAT(reason(wanted), HasSubstr("no run has"));
}

TEST(ClaimTest, OneRepetitionJudgesNothing) {
  std::vector<StudyResults> few = {
      {.name = "study", .directory = "", .runs = {level("low", 0, .2), level("high", 0, .8)}}};
  const ClaimResult result = judge(claim(ClaimKind::kGreater, {"high", "low"}), few);
  EXPECT_EQ(result.verdict, Verdict::kNotMeasured);
  EXPECT_EQ(result.measured, "fewer than two repetitions");
}

TEST(ClaimTest, RunsThatStoppedEarlyAreCountedNotHidden) {
  std::vector<StudyResults> given = studies();
  given[0].runs[0].rollouts.resize(4);
  const ClaimResult result = judge(claim(ClaimKind::kGreater, {"high", "low"}), given);
  EXPECT_EQ(result.n, "3, 2 of 3");
}

TEST(ClaimTest, FailedRolloutsCountWithTheirReward) {
  RunRecord run = level("a", 0, 1);
  run.rollouts[9].reward = 0;
  run.rollouts[9].status = RolloutStatus::kCrashed;
  EXPECT_DOUBLE_EQ(measure({run, {}}, {}).value(), .8);
}

TEST(ClaimTest, HolmsCorrectionIsOverTheClaimsThatAreTested) {
  std::vector<ClaimResult> results(4);
  results[0].p = .01;
  results[2].p = .04;
  results[3].p = .03;
  // By Holm: .01 x 3, .03 x 2, and no less for .04.
  const auto adjusted = adjusted_p(results);
  ASSERT_EQ(adjusted.size(), 4U);
  EXPECT_DOUBLE_EQ(*adjusted[0], .03);
  EXPECT_FALSE(adjusted[1]);
  EXPECT_DOUBLE_EQ(*adjusted[2], .06);
  EXPECT_DOUBLE_EQ(*adjusted[3], .06);
}

TEST(ClaimTest, WhatIsMeasuredOfTheSecondIsSaidWhereItIsAnother) {
  Claim drop = claim(ClaimKind::kGreater, {"low", "low"});
  drop.measure = drop.against = {.kind = MeasureKind::kBeforeSwitch};
  EXPECT_EQ(describe(drop), "reward of the five roll-outs up to the switch");
  drop.against.kind = MeasureKind::kAfterSwitch;
  EXPECT_EQ(describe(drop),
            "reward of the five roll-outs up to the switch (the first), reward of the five "
            "roll-outs after the switch (the second)");
  drop.kind = ClaimKind::kHighest;
  drop.conditions.emplace_back("high");
  EXPECT_THAT(describe(drop), HasSubstr("after the switch (the others)"));
  drop.kind = ClaimKind::kWithin;
  drop.conditions.resize(1);
  EXPECT_EQ(describe(drop), "reward of the five roll-outs up to the switch");
}

/// What it ended with counts to the end of its budget, in every measure.
TEST(MeasureTest, ARunThatHasReachedItsTargetGoesOnWithThatReward) {
  const RunEnding ending{.budget = 20, .stop_at_reward = .8};
  // The two that were under way when it was done are its own.
  const RunRecord record = run_with("c", 0, 0, {.1, .1, .1, .1, .1, .85, .2, .3});
  const MeasuredRun run(record, ending);
  EXPECT_TRUE(run.goes_on());
  const auto value = [&](MeasureKind kind, int rollout) {
    return measure(run, {.kind = kind, .rollout = rollout});
  };
  EXPECT_DOUBLE_EQ(value(MeasureKind::kNear, 8).value(), (.1 + .1 + .85 + .2 + .3) / 5);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kNear, 9).value(), (.1 + .85 + .2 + .3 + .85) / 5);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kNear, 20).value(), .85);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kNear, 0).value(), .85);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kBest, 20).value(), .85);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kMean, 20).value(), (.5 + .85 + .5 + 12 * .85) / 20);
  EXPECT_DOUBLE_EQ(value(MeasureKind::kGain, 20).value(), .75);
  EXPECT_FALSE(value(MeasureKind::kNear, 21));
  EXPECT_FALSE(measure({record, {}}, {.kind = MeasureKind::kBest, .rollout = 20}));
}

TEST(MeasureTest, ARunThatHasConvergedGoesOnWithItsLastRewardAndOneThatWasStoppedDoesNot) {
  const RunEnding ending{.budget = 20, .stop_at_reward = {}, .is_on_convergence = true};
  RunRecord record = run_with("c", 0, 0, {.1, .2, .3, .4, .5, .6});
  const auto last = [&] { return measure(MeasuredRun(record, ending), {.rollout = 20}); };
  EXPECT_FALSE(last()) << "it is under way";
  record.final_reward = .7;
  EXPECT_DOUBLE_EQ(last().value(), .6);
  EXPECT_FALSE(MeasuredRun(record, {.budget = 20}).goes_on()) << "it was stopped";
  EXPECT_FALSE(MeasuredRun(record, {.budget = 6, .is_on_convergence = true}).goes_on());
  record.rollouts.back().status = RolloutStatus::kDiscarded;
  EXPECT_FALSE(last()) << "it was given up";
}

TEST(MeasureTest, ARunThatNeverSwitchedCountsAtTheEndOfItsBudget) {
  const RunEnding ending{.budget = 150, .stop_at_reward = .8};
  RunRecord record = run_with("c", 0, 0, {.1, .9});
  EXPECT_EQ(measure({record, ending}, {.kind = MeasureKind::kSwitch}), 150);
  record.switches = {1};
  EXPECT_EQ(measure({record, ending}, {.kind = MeasureKind::kSwitch}), 2);
  record.rollouts.clear();
  record.switches.clear();
  EXPECT_FALSE(measure({record, ending}, {.kind = MeasureKind::kSwitch}));
}

}  // namespace
}  // namespace treeroll::report
