#include "learner/report/statistics/comparison.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/report/statistics/student_tail.h"
#include "tests/results/records.h"

namespace treeroll::report {
namespace {

using report_test::run_with;

/// Two runs of each condition.
struct TwoRuns {
  std::vector<RunRecord> runs;
  std::vector<MeasuredRun> measured(const RunEnding& ending = {}) const {
    return {{runs[0], ending}, {runs[1], ending}};
  }
};
TwoRuns runs(std::vector<double> first, std::vector<double> second) {
  return {{run_with("c", 0, 0, first), run_with("c", 1, 1, second)}};
}

TEST(ComparisonTest, TheFamilyIsAllPairsAtAllRollouts) {
  // At roll-out 1 a is 20 ahead with a standard error of sqrt(2); at roll-out 2 both are equal.
  const TwoRuns a = runs({20, 1}, {22, 3});
  const TwoRuns b = runs({0, 1}, {2, 3});
  const Comparison ahead = compare("a", a.measured(), "b", b.measured(), false);
  const Comparison behind = compare("b", b.measured(), "a", a.measured(), false);
  const double p = tail_of_two_degrees(20 / std::sqrt(2));
  EXPECT_NEAR(*ahead.p[0], p, 1e-12);
  EXPECT_NEAR(*behind.p[0], 1 - p, 1e-12);
  const auto family = family_wise({ahead, behind});
  ASSERT_EQ(family.size(), 2U);
  ASSERT_EQ(family[0].size(), 2U);
  // Four two-sided tests, of which this is the least, whichever side is named first.
  EXPECT_NEAR(*family[0][0], 4 * 2 * p, 1e-12);
  EXPECT_NEAR(*family[1][0], 4 * 2 * p, 1e-12);
  EXPECT_EQ(*family[0][1], 1);
}

TEST(ComparisonTest, ARolloutThatTooFewRunsReachedIsNotTestedAndCountsInNoFamily) {
  const TwoRuns a = runs({20, 20}, {22, 22});
  const TwoRuns b = runs({0, 0}, {2});
  const Comparison comparison = compare("a", a.measured(), "b", b.measured(), false);
  ASSERT_EQ(comparison.p.size(), 2U);
  EXPECT_FALSE(comparison.p[1]);
  EXPECT_FALSE(comparison.p_holm[1]);
  EXPECT_EQ(comparison.p_holm[0], comparison.p[0]);
  EXPECT_EQ(*family_wise({comparison})[0][0], 2 * *comparison.p[0]);
  EXPECT_FALSE(family_wise({comparison})[0][1]);
}

TEST(ComparisonTest, ARunThatIsDoneIsComparedToTheEndOfItsBudget) {
  const TwoRuns a = runs({.1, .9}, {.2, .3, .3, .8});
  const TwoRuns b = runs({.1, .2, .2, .3}, {.1, .2, .1, .2});
  const RunEnding ending{.budget = 4, .stop_at_reward = .8};
  const Comparison done = compare("a", a.measured(ending), "b", b.measured(ending), false);
  const TwoRuns in_full = runs({.1, .9, .9, .9}, {.2, .3, .3, .8});
  EXPECT_EQ(done.p, compare("a", in_full.measured(), "b", b.measured(), false).p);
  ASSERT_EQ(done.p.size(), 4U);
  EXPECT_TRUE(done.p[3]);
  EXPECT_FALSE(compare("a", a.measured(), "b", b.measured(), false).p[3]);
}

}  // namespace
}  // namespace treeroll::report
