#include "learner/results/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace treeroll {
namespace {

// Quantiles of Student's t at .975 as printed in tables (three decimals), by degrees of freedom.
struct TableEntry {
  int degrees;
  double quantile;
};
constexpr TableEntry kPrintedTable[] = {{1, 12.706}, {2, 4.303},  {3, 3.182}, {4, 2.776},
                                        {9, 2.262},  {29, 2.045}, {99, 1.984}};

TEST(StatisticsTest, TheIntervalUsesTheQuantilesOfPrintedTables) {
  for (const auto& [degrees, quantile] : kPrintedTable) {
    // n values around 0 of which two differ from it: sum of squares 2, deviation sqrt(2 / degrees).
    std::vector<double> values(static_cast<std::size_t>(degrees) + 1, 0.0);
    values[0] = 1;
    values[1] = -1;
    const auto interval = mean_interval_95(values);
    ASSERT_TRUE(interval);
    const double standard_error = std::sqrt(2.0 / degrees / (degrees + 1));
    EXPECT_NEAR(interval->high / standard_error, quantile, 6e-4) << degrees;
    EXPECT_DOUBLE_EQ(interval->low, -interval->high);
  }
}

TEST(StatisticsTest, TheIntervalOfFiveNumbersIsTheOneComputedByHand) {
  // Mean .9; squares .01 + .0025 + 0 + .0025 + .01 = .025; s = sqrt(.00625);
  // s / sqrt(5) = .0353553; times 2.776445 = .0981622.
  const auto interval = mean_interval_95({.8, .85, .9, .95, 1});
  ASSERT_TRUE(interval);
  EXPECT_NEAR(interval->low, .8018378, 1e-6);
  EXPECT_NEAR(interval->high, .9981622, 1e-6);
}

TEST(StatisticsTest, OneValueHasNoInterval) {
  EXPECT_EQ(mean_interval_95({.5}), std::nullopt);
  EXPECT_EQ(mean_interval_95({}), std::nullopt);
}

TEST(StatisticsTest, EqualValuesHaveAnIntervalOfNoWidth) {
  EXPECT_EQ(mean_interval_95({.5, .5, .5}), (Interval{.low = .5, .high = .5}));
}

TEST(StatisticsTest, TheMedianOfAnEvenNumberLiesBetweenTheMiddleTwo) {
  EXPECT_EQ(median({4, 1, 3}), 3);
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({}), std::nullopt);
}

TEST(StatisticsTest, TheIntervalOfADeviationIsTheTabulatedOne) {
  // Chi-square of 4 degrees: 2.5 % below .484419, 2.5 % above 11.143287. Squares add to .025.
  const auto interval = deviation_interval_95({.8, .85, .9, .95, 1});
  ASSERT_TRUE(interval);
  EXPECT_NEAR(interval->low, std::sqrt(.025 / 11.143287), 1e-6);
  EXPECT_NEAR(interval->high, std::sqrt(.025 / .484419), 1e-6);
  EXPECT_EQ(deviation_interval_95({.5}), std::nullopt);
  EXPECT_NEAR(*deviation({.8, .85, .9, .95, 1}), std::sqrt(.00625), 1e-12);
  EXPECT_EQ(deviation({1}), std::nullopt);
}

TEST(StatisticsTest, TheIntervalOfAMedianIsOfTheTabulatedRanks) {
  // Ranks of the two-sided sign test at 5 %: 1 and 6 of 6, 2 and 9 of 10, 10 and 21 of 30.
  struct Ranks {
    int count;
    double low;
    double high;
  };
  for (const auto& [count, low, high] : {Ranks{6, 1, 6}, {10, 2, 9}, {30, 10, 21}}) {
    std::vector<double> values(static_cast<std::size_t>(count));
    std::iota(values.rbegin(), values.rend(), 1.0);
    EXPECT_EQ(median_interval_95(values), (Interval{.low = low, .high = high}));
  }
  EXPECT_EQ(median_interval_95({1, 2, 3, 4, 5}), std::nullopt);
  EXPECT_EQ(median_interval_95({}), std::nullopt);
}

TEST(StatisticsTest, NoValuesHaveNoMean) {
  EXPECT_EQ(mean({}), std::nullopt);
  EXPECT_EQ(mean({1, 2, 6}), 3);
}

}  // namespace
}  // namespace treeroll
