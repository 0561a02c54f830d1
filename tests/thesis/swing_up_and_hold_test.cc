#include "tests/thesis/swing_up_and_hold.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/thesis/studies.h"

/// Swing up, then hold: a small form of the study; swing_up_and_hold_long_test.cc has the whole.
namespace treeroll {
namespace {

TEST(SwingUpAndHoldLearningTest, PerturbedPlantsAreHeldWithFeedbackAndFallWithout) {
  const std::vector<RunRecord> runs = run_study(
      kStudies / "swing_up_and_hold.toml",
      {"study.repetitions=3", "study.rollouts=300", "study.final_evaluations=10", "study.seed=2"});
  const Held closed = count_held(runs, "closed");
  const Held open = count_held(runs, "open");
  std::printf("  closed: %d of %d plants held; open: %d\n", closed.held, closed.plants, open.held);
  EXPECT_EQ(closed.plants, 30);
  EXPECT_EQ(closed.held, closed.plants);
  EXPECT_EQ(open.plants, 30);
  EXPECT_EQ(open.held, 0);
  for (const RunRecord& run : of_condition(runs, "closed")) {
    ASSERT_TRUE(run.start);
    EXPECT_LT(run.start->reward(), .5) << "the start policy does not swing up";
  }
}

}  // namespace
}  // namespace treeroll
