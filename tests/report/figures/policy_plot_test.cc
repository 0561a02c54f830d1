#include "learner/report/figures/policy_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <sstream>

#include "common/policy/network/network_policy.h"
#include "tests/report/figures/tree_policies.h"

namespace treeroll::report {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TreeModel one_gaussian(double mean_output) {
  Component component{1, Eigen::Vector2d(1, mean_output), Eigen::Matrix2d::Zero()};
  component.covariance << .25, .3, .3, 4;
  return TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, {component})}, {{}});
}

LearntPolicy learnt(const std::string& condition, TreeModel start, PolicyPtr best = nullptr) {
  return {.condition = condition, .start = as_policy(std::move(start)), .best = std::move(best)};
}

/// A Gaussian over one input and two outputs, uncorrelated.
TreeModel two_outputs() {
  const Component component{1, Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(1, 4, 9).asDiagonal()};
  return TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, {component})}, {{}});
}

/// output = 2 x first - 3 x second + 5, around (1, -1).
TreeModel two_inputs() {
  Component component{1, Eigen::Vector3d(1, -1, 10), Eigen::Matrix3d::Identity()};
  component.covariance << 1, 0, 2, 0, .25, -.75, 2, -.75, 10;
  return TreeModel::from_global(FrameKind::kCholesky, {Gmm(2, {component})}, {{}});
}

/// What a task of two outputs records, with a goal for each.
ShownRollout traced() {
  return {.reward = .5,
          .trace = {.columns = {"t_s", "x_m", "y_m", "goal_x_m", "goal_y_m"},
                    .numbers = {0, 1, 2, 10, 20, 1, 1, 2, 11, 21},
                    .policy_inputs = {"t_s"},
                    .policy_outputs = {"x_m", "y_m"},
                    .poses = {}}};
}

TEST(PolicyPlotTest, EllipsesAreTwoStandardDeviationsAround) {
  const Plot plot = policy_plots("mine", {learnt("flat", one_gaussian(3))}).front();
  std::istringstream lines(plot.data);
  std::string line;
  std::getline(lines, line);
  Eigen::Matrix2d covariance;
  covariance << .25, .3, .3, 4;
  int num_points = 0;
  while (std::getline(lines, line) && !line.empty()) {
    std::istringstream numbers(line);
    Eigen::Vector2d at;
    numbers >> at[0] >> at[1];
    at -= Eigen::Vector2d(1, 3);
    EXPECT_NEAR(at.dot(covariance.ldlt().solve(at)), 4, 1e-9) << line;
    ++num_points;
  }
  EXPECT_EQ(num_points, 49);
}

TEST(PolicyPlotTest, RegressionOfOneGaussianIsItsLineOverTheInputsItCovers) {
  const Plot plot = policy_plots("mine", {learnt("flat", one_gaussian(3))}).front();
  // Slope .3 / .25, from two deviations of .5 below the mean to two above.
  EXPECT_THAT(plot.data, HasSubstr("regression\n0 1.8"));
  EXPECT_THAT(plot.data, HasSubstr("\n2 4.2"));
  EXPECT_THAT(plot.commands, Not(HasSubstr("further layers")));
}

TEST(PolicyPlotTest, TheBestIsDrawnOverTheStart) {
  const PolicyPtr best = as_policy(one_gaussian(5));
  const Plot plot = policy_plots("mine", {learnt("it's", one_gaussian(3), best)}).front();
  EXPECT_THAT(plot.data, HasSubstr("regression\n0 3.8"));
  EXPECT_THAT(plot.commands, HasSubstr("set title 'it''s'"));
}

TEST(PolicyPlotTest, SeveralInputsAreNotDrawnOverOne) {
  const std::vector<LearntPolicy> policies = {learnt("closed", two_inputs()),
                                              learnt("open", one_gaussian(3))};
  EXPECT_THAT(policy_plots("mine", policies).front().commands, Not(HasSubstr("closed")));
  EXPECT_THAT(path_plots("mine", policies), IsEmpty());
  EXPECT_THAT(solution_plots("mine", policies), IsEmpty());
  EXPECT_THAT(slice_plots("mine", policies).front().commands, Not(HasSubstr("open")));
}

TEST(PolicyPlotTest, ConditionsThatShareAPartStandBesideEachOther) {
  const Plot plot = policy_plots("mine", {learnt("single.flat", one_gaussian(1)),
                                          learnt("single.tree", one_gaussian(2)),
                                          learnt("multi.tree", one_gaussian(3))})
                        .front();
  EXPECT_EQ(plot.height_px, 2 * 320 + 40);
  const std::size_t second = plot.commands.find("'multi.tree'");
  EXPECT_THAT(plot.commands.substr(second - 100, 100), HasSubstr("set origin 0.000000,0.000000;"));
}

TEST(PolicyPlotTest, EveryOutputIsDrawn) {
  const auto plots = policy_plots("mine", {learnt("flat", two_outputs())});
  ASSERT_EQ(plots.size(), 2);
  EXPECT_EQ(plots[0].id, "policies");
  EXPECT_THAT(plots[0].data, HasSubstr("regression\n-1 2\n"));
  EXPECT_EQ(plots[1].id, "policies_output_2");
  EXPECT_THAT(plots[1].data, HasSubstr("regression\n-1 3\n"));
  EXPECT_THAT(plots[1].title, HasSubstr("output 2 of 2"));
}

TEST(PolicyPlotTest, EveryConditionIsOnOnePageOrAnother) {
  std::vector<LearntPolicy> policies;
  for (int i = 0; i < 25; ++i) policies.push_back(learnt("c" + std::to_string(i), one_gaussian(i)));
  const auto plots = policy_plots("mine", policies);
  ASSERT_EQ(plots.size(), 3);
  EXPECT_THAT(plots[0].commands, HasSubstr("set title 'c11'"));
  EXPECT_THAT(plots[1].commands, HasSubstr("set title 'c12'"));
  EXPECT_EQ(plots[2].id, "policies_page_3");
  EXPECT_THAT(plots[2].commands, HasSubstr("set title 'c24'"));
}

TEST(PolicyPlotTest, AxesAndGoalsAreTheTasks) {
  LearntPolicy policy = learnt("flat", two_outputs());
  const Plot plain = policy_plots("mine", {policy}).front();
  EXPECT_THAT(plain.commands, HasSubstr("set xlabel 'input'; set ylabel 'output 1'"));
  EXPECT_THAT(plain.commands, Not(HasSubstr("'goal'")));
  policy.start_rollout = traced();
  const auto plots = policy_plots("mine", {policy});
  EXPECT_THAT(plots[0].commands, HasSubstr("set xlabel 't (s)'; set ylabel 'x (m)'"));
  EXPECT_THAT(plots[0].data, HasSubstr("goal\n0 10\n1 11\n\n\n"));
  EXPECT_THAT(plots[1].data, HasSubstr("goal\n0 20\n1 21\n\n\n"));
  EXPECT_THAT(plots[1].commands, HasSubstr("with lines lt 9 title 'goal'"));
  EXPECT_THAT(plots[1].caption, HasSubstr("the task's goal"));
}

TEST(PolicyPlotTest, ATraceOfOtherVariablesNamesNoAxis) {
  LearntPolicy policy = learnt("flat", one_gaussian(3));
  policy.start_rollout = traced();
  EXPECT_THAT(policy_plots("mine", {policy}).front().commands, HasSubstr("set xlabel 'input'"));
}

TEST(PolicyPlotTest, TheDemonstrationsNamesComeBeforeTheTasks) {
  LearntPolicy policy = learnt("flat", two_outputs());
  policy.columns = {"t_ms", "left_deg", "right"};
  EXPECT_THAT(policy_plots("mine", {policy})[1].commands,
              HasSubstr("set xlabel 't (ms)'; set ylabel 'right'"));
  policy.start_rollout = traced();
  const Plot plot = policy_plots("mine", {policy}).front();
  EXPECT_THAT(plot.commands, HasSubstr("set ylabel 'left (°)'"));
  EXPECT_THAT(plot.data, HasSubstr("goal\n0 10\n1 11\n\n\n"));  // still found by the task's names
}

TEST(SolutionPlotTest, EveryRepetitionsBestIsALineOverTheGoal) {
  LearntPolicy policy = learnt("flat", two_outputs());
  policy.start_rollout = traced();
  EXPECT_THAT(solution_plots("mine", {policy}), IsEmpty());
  for (int i = 0; i < 30; ++i) policy.solutions.push_back(as_policy(two_outputs()));
  const auto plots = solution_plots("mine", {policy, learnt("unlearnt", two_outputs())});
  ASSERT_EQ(plots.size(), 3U);
  EXPECT_EQ(plots[0].id, "solutions");
  EXPECT_EQ(plots[1].id, "solutions_output_2");
  EXPECT_EQ(plots[2].id, "solution_paths");
  // One data set of thirty lines, over the times of the task: from 0, each at 2.
  std::size_t num_lines = 0;
  for (std::size_t at = plots[0].data.find("\n0 2\n"); at != std::string::npos;
       at = plots[0].data.find("\n0 2\n", at + 1)) {
    ++num_lines;
  }
  EXPECT_EQ(num_lines, 30U + 1);  // and the start
  EXPECT_THAT(plots[0].data, HasSubstr("goal\n0 10\n1 11\n"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set title 'flat (30)'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("with lines lt 2 title 'goal'"));
  EXPECT_THAT(plots[0].commands, Not(HasSubstr("unlearnt")));
  EXPECT_THAT(plots[2].commands, HasSubstr("set size ratio -1"));
}

TEST(SlicePlotTest, EachInputIsVariedWhileTheOthersStandInTheMiddle) {
  const auto plots = slice_plots("mine", {learnt("closed", two_inputs())});
  ASSERT_EQ(plots.size(), 1U);
  // Two deviations around 1 with the second input at -1, output 2 x + 8; then around -1 with the
  // first at 1, output 7 - 3 x.
  EXPECT_THAT(plots[0].data, HasSubstr("slice\n-1 6\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("\n3 14\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("slice\n-2 13\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("\n0 7\n"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set xlabel 'input 2'; set ylabel 'output 1'"));
}

/// A kind without Gaussians: before, every input was cut over the range of the first, in its
/// middle.
TEST(SlicePlotTest, ANetworkIsCutOverTheRangeOfEachInput) {
  // tanh(z1 - z2) of inputs scaled from [-1, 3] and [10, 30] to [-1, 1].
  Network network{.ranges = {{-1, 3}, {10, 30}},
                  .outer = Eigen::RowVector2d(1, 0),
                  .inner = Eigen::RowVector3d(1, -1, 0)};
  const LearntPolicy policy{.condition = "closed",
                            .start = std::make_shared<NetworkPolicy>(std::move(network))};
  const Plot plot = slice_plots("mine", {policy}).front();
  EXPECT_THAT(plot.data, HasSubstr("slice\n-1 -0.76159415"));
  EXPECT_THAT(plot.data, HasSubstr("\n3 0.76159415"));
  EXPECT_THAT(plot.data, HasSubstr("slice\n10 0.76159415"));
  EXPECT_THAT(plot.data, HasSubstr("\n30 -0.76159415"));
  EXPECT_THAT(plot.commands, HasSubstr("set xrange [-1:3]"));
  EXPECT_THAT(plot.commands, HasSubstr("set xrange [10:30]"));
  EXPECT_THAT(plot.caption, HasSubstr("in the middle of where the start acts"));
}

TEST(SlicePlotTest, WithARolloutItIsCutWhereTheRolloutWas) {
  LearntPolicy policy = learnt("closed", two_inputs());
  policy.best_rollout = {.reward = .5,
                         .trace = {.columns = {"t_s", "phi_rad", "y_m", "u_n"},
                                   .numbers = {0, 0, 5, 1, 1, 1, 5, 2, 2, 4, 6, 3},
                                   .policy_inputs = {"phi_rad", "y_m"},
                                   .policy_outputs = {"u_n"},
                                   .poses = {}}};
  const Plot plot = slice_plots("mine", {policy}).front();
  // phi from 0 to 4 while y stands at its median 5: 2 x - 10.
  EXPECT_THAT(plot.data, HasSubstr("slice\n0 -10\n"));
  EXPECT_THAT(plot.data, HasSubstr("\n4 -2\n"));
  EXPECT_THAT(plot.data, HasSubstr("the best roll-out\n0 1\n1 2\n4 3\n"));
  EXPECT_THAT(plot.commands, HasSubstr("set xlabel 'phi (rad)'; set ylabel 'u (N)'"));
  EXPECT_THAT(plot.commands, HasSubstr("set xrange [0:4]"));
}

TEST(PathPlotTest, TwoOutputsAreDrawnOneOverTheOther) {
  LearntPolicy policy = learnt("flat", two_outputs());
  policy.start_rollout = traced();
  const auto plots = path_plots("mine", {policy, learnt("other", one_gaussian(3))});
  ASSERT_EQ(plots.size(), 1);
  EXPECT_EQ(plots[0].id, "paths");
  EXPECT_THAT(plots[0].data, HasSubstr("goal\n10 20\n11 21\n\n\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("ellipses\n6 3\n"));  // 2 + 2 x 2
  EXPECT_THAT(plots[0].commands, HasSubstr("set xlabel 'x (m)'; set ylabel 'y (m)'"));
  EXPECT_THAT(plots[0].commands, Not(HasSubstr("'other'")));
  EXPECT_THAT(plots[0].commands, HasSubstr("set size ratio -1; set xrange ["));
}

TEST(GoalPlotTest, GoalsThatAreNoOutputsOfThePolicyHaveAFigure) {
  LearntPolicy policy = learnt("flat", one_gaussian(3));
  EXPECT_THAT(goal_plots("mine", {policy}), IsEmpty());
  policy.start_rollout = traced();
  policy.start_rollout->trace.policy_outputs = {"y_m"};  // drawn with the policy
  policy.best_rollout = policy.start_rollout;
  policy.best_rollout->trace.numbers[1] = 7;
  const auto plots = goal_plots("mine", {policy});
  ASSERT_EQ(plots.size(), 1);
  EXPECT_EQ(plots[0].title, "x (m) of mine before and after learning");
  EXPECT_THAT(plots[0].data, HasSubstr("goal\n0 10\n1 11\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("best\n0 7\n1 1\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("start\n0 1\n1 1\n"));
}

}  // namespace
}  // namespace treeroll::report
