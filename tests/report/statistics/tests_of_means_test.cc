#include "learner/report/statistics/tests_of_means.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/report/statistics/student_tail.h"

namespace treeroll::report {
namespace {

using Values = std::vector<double>;

// With one degree of freedom Student's t is Cauchy's distribution: P(T > t) = 1/2 - atan(t) / pi.
double cauchy_tail(double t) { return .5 - std::atan(t) / std::numbers::pi; }

TEST(WelchTest, EqualVariancesOfTwoValuesEachGiveTheClosedFormOfTwoDegrees) {
  // Means 3 and 1, variances 2 each: standard error sqrt(2), t = sqrt(2), 2 degrees.
  const auto test = welch_greater({2, 4}, {0, 2});
  ASSERT_TRUE(test);
  EXPECT_DOUBLE_EQ(test->degrees, 2);
  EXPECT_DOUBLE_EQ(test->t, std::sqrt(2));
  EXPECT_NEAR(test->p, tail_of_two_degrees(std::sqrt(2)), 1e-15);
  // The .975 quantile of two degrees is .95 / sqrt(.975 * .025 * 2), from inverting the tail.
  const double half = .95 / std::sqrt(.975 * .025 * 2) * std::sqrt(2);
  EXPECT_NEAR(test->interval_95.low, 2 - half, 1e-9);
  EXPECT_NEAR(test->interval_95.high, 2 + half, 1e-9);
}

TEST(WelchTest, WithoutSpreadOnOneSideTheDegreesAreTheOthers) {
  const auto test = welch_greater({2, 4}, {1, 1, 1, 1});
  ASSERT_TRUE(test);
  EXPECT_DOUBLE_EQ(test->degrees, 1);
  EXPECT_NEAR(test->p, cauchy_tail(2), 1e-15);
}

TEST(WelchTest, StudentsSleepDataGiveThePublishedFigures) {
  // Student's sleep data (1908) as in the manual of R: t = -1.8608, df = 17.776, two-sided p =
  // .07939, interval -3.3654832 .2054832; paired t = -4.0621, df = 9, p = .002833, interval
  // -2.4598858 -.7001142.
  const Values first = {.7, -1.6, -.2, -1.2, -.1, 3.4, 3.7, .8, 0, 2};
  const Values second = {1.9, .8, 1.1, .1, -.1, 4.4, 5.5, 1.6, 4.6, 3.4};
  const auto test = welch_greater(second, first);
  ASSERT_TRUE(test);
  EXPECT_NEAR(test->t, 1.8608, 5e-5);
  EXPECT_NEAR(test->degrees, 17.776, 5e-4);
  EXPECT_NEAR(test->p, .07939 / 2, 5e-6);
  EXPECT_NEAR(test->interval_95.low, -.2054832, 5e-8);
  EXPECT_NEAR(test->interval_95.high, 3.3654832, 5e-8);
  const auto paired = paired_greater(second, first);
  ASSERT_TRUE(paired);
  EXPECT_NEAR(paired->t, 4.0621, 5e-5);
  EXPECT_NEAR(paired->p, .002833 / 2, 5e-7);
  EXPECT_NEAR(paired->interval_95.low, .7001142, 5e-8);
}

TEST(WelchTest, TheOtherSideHasTheRestOfTheProbability) {
  const Values a = {.1, .5, .2, .9};
  const Values b = {.3, .4, .8};
  EXPECT_NEAR(welch_greater(a, b)->p + welch_greater(b, a)->p, 1, 1e-14);
}

TEST(WelchTest, WithoutSpreadWhatIsSeenIsCertain) {
  EXPECT_EQ(welch_greater({.1, .1, .1}, {.1, .1, .1})->p, .5);
  EXPECT_EQ(welch_greater({1, 1}, {0, 0})->p, 0);
  EXPECT_EQ(welch_greater({0, 0}, {1, 1})->p, 1);
  EXPECT_EQ(welch_greater({1, 1}, {0, 0})->interval_95, (Interval{.low = 1, .high = 1}));
  EXPECT_EQ(paired_greater({1, 2}, {0, 1})->p, 0);
}

TEST(WelchTest, OneRepetitionHasNoResult) {
  EXPECT_FALSE(welch_greater({1}, {0, 1}));
  EXPECT_FALSE(paired_greater({1}, {0}));
  EXPECT_FALSE(equivalent_p({1}, {0, 1}, .1));
  EXPECT_FALSE(hedges_g({1}, {0, 1}));
}

TEST(EquivalenceTest, IsTheWorseOfTwoOneSidedTests) {
  // Difference 0, standard error sqrt(2), two degrees: both sides have t = margin / sqrt(2).
  EXPECT_NEAR(*equivalent_p({2, 4}, {4, 2}, 3), tail_of_two_degrees(3 / std::sqrt(2)), 1e-14);
  // Difference 2 of margin 3: the side that counts is 1 away.
  EXPECT_NEAR(*equivalent_p({2, 4}, {0, 2}, 3), tail_of_two_degrees(1 / std::sqrt(2)), 1e-14);
  EXPECT_EQ(*equivalent_p({1, 1}, {1, 1}, .1), 0);
  EXPECT_EQ(*equivalent_p({2, 2}, {1, 1}, .1), 1);
}

TEST(HedgesTest, CorrectsTheStandardizedDifference) {
  // Pooled deviation sqrt(2), difference 2. Correction at 2 degrees: gamma(1) / gamma(1/2) = 1 /
  // sqrt(pi).
  EXPECT_NEAR(*hedges_g({2, 4}, {0, 2}), 2 / std::sqrt(2) / std::sqrt(std::numbers::pi), 1e-14);
  EXPECT_FALSE(hedges_g({1, 1}, {0, 0}));
}

TEST(HolmTest, IsTheStepDownComputedByHand) {
  // Ordered .005 .01 .03 .04 times 4 3 2 1: .02 .03 .06 .04, never falling: .02 .03 .06 .06.
  const Values adjusted = holm({.01, .04, .03, .005});
  const Values expected = {.03, .06, .06, .02};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_DOUBLE_EQ(adjusted[i], expected[i]);
  EXPECT_EQ(holm({.6, .7}), (Values{1, 1}));
  EXPECT_TRUE(holm({}).empty());
}

TEST(HolmTest, IsThatOfR) {
  // p.adjust(c(.01, .02, .03, .04, .05), "holm") of R gives .05 .08 .09 .09 .09.
  const Values adjusted = holm({.01, .02, .03, .04, .05});
  const Values expected = {.05, .08, .09, .09, .09};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15);
}

TEST(HolmTest, WhatIsNotThereCountsNot) {
  const auto adjusted = holm_of_present({{}, .01, {}, .04});
  EXPECT_FALSE(adjusted[0]);
  EXPECT_EQ(*adjusted[1], .02);
  EXPECT_EQ(*adjusted[3], .04);
}

TEST(HolmTest, TwoSidedIsTheSmallerSideTwice) {
  EXPECT_EQ(two_sided(.01), .02);
  EXPECT_NEAR(two_sided(.99), .02, 1e-15);
  EXPECT_EQ(two_sided(.5), 1);
}

TEST(TrendTest, APerfectOrderIsCertainAndItsReverseImpossible) {
  EXPECT_EQ(growing({{1}, {2}, {3}})->p, 0);
  EXPECT_EQ(growing({{3}, {2}, {1}})->p, 1);
}

TEST(TrendTest, SpearmansCorrelationWithTiesIsTheOneComputedByHand) {
  // Ranks of values 1 3 2, of places 1 2 3: correlation .5, t = 1 / sqrt(3), one degree: 1/3.
  const auto trend = growing({{10}, {30}, {20}});
  EXPECT_DOUBLE_EQ(trend->correlation, .5);
  EXPECT_NEAR(trend->p, cauchy_tail(1 / std::sqrt(3)), 1e-14);
  // Values 1 2 | 2 3: ranks 1 2.5 2.5 4 against 1.5 1.5 3.5 3.5: 3 / sqrt(4.5 * 4).
  EXPECT_NEAR(growing({{1, 2}, {2, 3}})->correlation, 3 / std::sqrt(18), 1e-14);
  EXPECT_EQ(growing({{1, 1}, {1, 1}})->p, .5);
  EXPECT_FALSE(growing({{1, 2, 3}}));
  EXPECT_FALSE(growing({{1}, {2}}));
}

TEST(QuartilesTest, InterpolateBetweenOrderedValues) {
  EXPECT_EQ(quartiles({4, 1, 3, 2}), (Quartiles{.low = 1.75, .median = 2.5, .high = 3.25}));
  EXPECT_EQ(quartiles({7}), (Quartiles{.low = 7, .median = 7, .high = 7}));
  EXPECT_FALSE(quartiles({}));
}

TEST(ShareTest, LimitsAreClopperAndPearsons) {
  // No success in n: the upper limit is 1 - .025^(1/n); all: the mirror image.
  const Interval none = share_interval_95(0, 30);
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 1 - std::pow(.025, 1. / 30), 1e-12);
  EXPECT_NEAR(share_interval_95(30, 30).low, std::pow(.025, 1. / 30), 1e-12);
  EXPECT_EQ(share_interval_95(30, 30).high, 1);
}

}  // namespace
}  // namespace treeroll::report
