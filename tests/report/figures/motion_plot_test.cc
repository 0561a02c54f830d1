#include "learner/report/figures/motion_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/report/figures/tree_policies.h"

namespace treeroll::report {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TreeModel unit_gaussian() {
  return TreeModel::from_global(
      FrameKind::kCholesky, {Gmm(1, {{1, Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity()}})},
      {{}});
}

/// A rod of 1 m, upright at x = time.
ShownRollout moving(int num_rows, double reward) {
  ShownRollout rollout{.reward = reward,
                       .trace = {.columns = {"time_s"},
                                 .numbers = {},
                                 .policy_inputs = {},
                                 .policy_outputs = {},
                                 .poses = {}}};
  for (int i = 0; i < num_rows; ++i) {
    const double time_s = 1. * i / (num_rows - 1);
    rollout.trace.numbers.push_back(time_s);
    rollout.trace.poses.push_back({{time_s, 0, time_s, 1}});
  }
  return rollout;
}

LearntPolicy policy(const std::string& condition) {
  LearntPolicy policy{.condition = condition, .start = as_policy(unit_gaussian())};
  policy.start_rollout = moving(37, .25);
  return policy;
}

TEST(MotionPlotTest, InstantsStandSideBySideOneBoxApart) {
  const auto plots = motion_plots("mine", {policy("flat")});
  ASSERT_EQ(plots.size(), 1);
  EXPECT_EQ(plots[0].id, "motion");
  // Nothing is left of x = 0 and the last but one, row 32 of 36, at .8889: with .05 m of air on
  // either side the second instant, row 4, is .9889 m on.
  EXPECT_THAT(plots[0].data, HasSubstr("at the instants\n0 0\n0 1\n\n1.09999"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set xtics ('0.00' 0, '0.11' 0.988889, '0.22' 1.97778"));
  EXPECT_THAT(plots[0].commands,
              HasSubstr("'flat: start, reward 0.250, 0.99 m from line to line'"));
  EXPECT_THAT(plots[0].caption, HasSubstr("time (s)"));
}

TEST(MotionPlotTest, StartAndBestHaveAStripEachOnOneScale) {
  LearntPolicy learnt = policy("flat");
  learnt.best_rollout = moving(5, .9);
  for (auto& pose : learnt.best_rollout->trace.poses) pose[0][3] = 3;
  const Plot plot = motion_plots("mine", {learnt}).front();
  EXPECT_THAT(plot.commands, HasSubstr("'flat: best, reward 0.900, "));
  // Three m high, both.
  const auto first = plot.commands.find("set yrange [-0.15:3.15]");
  ASSERT_NE(first, std::string::npos);
  EXPECT_NE(plot.commands.find("set yrange [-0.15:3.15]", first + 1), std::string::npos);
}

TEST(MotionPlotTest, TheTimesBelowTheLastStripAreOnThePage) {
  LearntPolicy learnt = policy("flat");
  learnt.best_rollout = moving(5, .9);
  const Plot plot = motion_plots("mine", {learnt}).front();
  const std::string word = "set bmargin at screen ";
  const double bottom = std::stod(plot.commands.substr(plot.commands.rfind(word) + word.size()));
  // gnuplot 5.4 puts their base line 24 px below the strip; 3 px are below the line.
  EXPECT_GE(bottom * plot.height_px, 27);
}

TEST(MotionPlotTest, AFailedRolloutSaysHowItEnded) {
  LearntPolicy learnt = policy("flat");
  learnt.start_rollout->status = "diverged";
  learnt.start_rollout->trace.poses.back()[0][0] = std::nan("");
  const Plot plot = motion_plots("mine", {learnt}).front();
  EXPECT_THAT(plot.commands, HasSubstr("'flat: start, diverged, "));
  EXPECT_THAT(plot.data, HasSubstr("NaN 0\n"));
}

TEST(MotionPlotTest, WithoutPosesThereIsNothingToSee) {
  LearntPolicy learnt = policy("flat");
  learnt.start_rollout->trace.poses.clear();
  EXPECT_THAT(motion_plots("mine", {learnt}), IsEmpty());
  learnt.start_rollout->trace.poses.assign(37, {});
  EXPECT_THAT(motion_plots("mine", {learnt}), IsEmpty());
  EXPECT_THAT(motion_plots("mine", {{.condition = "a", .start = as_policy(unit_gaussian())}}),
              IsEmpty());
}

TEST(MotionPlotTest, PosesWithoutANumberAreDrawnAsNothing) {
  LearntPolicy learnt = policy("flat");
  for (auto& pose : learnt.start_rollout->trace.poses) pose[0].assign(4, std::nan(""));
  EXPECT_THAT(motion_plots("mine", {learnt}), IsEmpty());
}

TEST(MotionPlotTest, EveryConditionIsOnOnePageOrAnother) {
  std::vector<LearntPolicy> policies;
  for (int i = 0; i < 5; ++i) policies.push_back(policy("c" + std::to_string(i)));
  const auto plots = motion_plots("mine", policies);
  ASSERT_EQ(plots.size(), 2);
  EXPECT_THAT(plots[0].commands, Not(HasSubstr("c4")));
  EXPECT_THAT(plots[1].commands, HasSubstr("c4"));
}

}  // namespace
}  // namespace treeroll::report
