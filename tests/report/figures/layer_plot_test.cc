#include "learner/report/figures/layer_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"
#include "tests/report/figures/tree_policies.h"

namespace treeroll::report {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Component at(double input, double output) {
  return {.5, Eigen::Vector2d(input, output), Eigen::Matrix2d::Identity()};
}

/// One Gaussian at (0, 0), and its two children at (-1, 1) and (1, 3).
TreeModel tree() {
  return TreeModel::from_global(FrameKind::kCholesky,
                                {Gmm(1, {at(0, 0)}), Gmm(1, {at(-1, 1), at(1, 3)})}, {{}, {0, 0}});
}

StartModel fitted(Eigen::Index num_samples) {
  Eigen::MatrixXd samples(2, num_samples);
  for (Eigen::Index i = 0; i < num_samples; ++i) samples.col(i) << 1. * i, 2. * i;
  return {.conditions = {"tree"},
          .policy = as_policy(tree()),
          .demonstration = std::make_shared<const Eigen::MatrixXd>(samples),
          .log_likelihoods = {-.75, -.5},
          .columns = {"time_s", "x_m"}};
}

TEST(LayerPlotTest, EachLayerHasAPanelWithItsGaussiansAndItsFit) {
  const auto plots = layer_plots("mine", {fitted(3)});
  ASSERT_EQ(plots.size(), 1);
  EXPECT_EQ(plots[0].id, "layers");
  EXPECT_THAT(plots[0].commands, HasSubstr("set title 'tree, layer 1'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set title 'tree, layer 2'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("'log-likelihood -0.7500'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("'log-likelihood -0.5000'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set xlabel 'time (s)'; set ylabel 'x (m)'"));
  EXPECT_THAT(plots[0].data, HasSubstr("demonstration\n0 0\n1 2\n2 4\n\n\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("ellipses\n2 0\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("ellipses\n1 1\n"));
  EXPECT_THAT(plots[0].data, HasSubstr("\n3 3\n"));
}

TEST(LayerPlotTest, AStartThatGivesOneNumberHasARangeAroundIt) {
  const auto ladder = std::make_shared<SplineLadder>(BSpline(1, 2, 0, 1), 1);
  const auto starting_with = [&](double first, double last) {
    const auto line = std::make_shared<LinearPolicy>(std::make_shared<SplineForm>(ladder, nullptr),
                                                     Eigen::RowVector2d(first, last), 1);
    return StartModel{.conditions = {"spline"}, .policy = line, .demonstration = nullptr};
  };
  // The second panel of a page is not drawn by what the first one holds.
  const Plot plot = layer_plots("mine", {starting_with(0, 5), starting_with(3, 3)}).front();
  EXPECT_THAT(plot.commands, HasSubstr("set yrange [*:*]"));
  EXPECT_THAT(plot.commands, HasSubstr("set yrange [2:4]"));
}

TEST(LayerPlotTest, WhatAKindDoesNotHaveIsNotNamed) {
  const auto ladder = std::make_shared<SplineLadder>(BSpline(1, 2, 0, 1), 1);
  const auto line = std::make_shared<LinearPolicy>(std::make_shared<SplineForm>(ladder, nullptr),
                                                   Eigen::RowVector2d(0, 1), 1);
  const Plot plot =
      layer_plots("mine", {{.conditions = {"spline"}, .policy = line, .demonstration = nullptr}})
          .front();
  EXPECT_THAT(plot.commands, HasSubstr("'policy'"));
  EXPECT_THAT(plot.commands, Not(HasSubstr("Gaussians")));
  EXPECT_THAT(plot.caption, Not(HasSubstr("Gaussians")));
  EXPECT_THAT(layer_plots("mine", {fitted(3)}).front().commands, HasSubstr("Gaussians"));
}

TEST(LayerPlotTest, AStartThatWasGivenHasNoSamplesAndNoLikelihood) {
  const auto plots = layer_plots(
      "mine",
      {{.conditions = {"a", "b", "c"}, .policy = as_policy(tree()), .demonstration = nullptr}});
  EXPECT_THAT(plots[0].data, Not(HasSubstr("demonstration")));
  EXPECT_THAT(plots[0].commands, Not(HasSubstr("log-likelihood")));
  EXPECT_THAT(plots[0].caption, Not(HasSubstr("demonstration")));
  EXPECT_THAT(plots[0].commands, HasSubstr("'a and 2 more, layer 1'"));
  EXPECT_THAT(plots[0].commands, HasSubstr("set xlabel 'input'; set ylabel 'output 1'"));
}

TEST(LayerPlotTest, TheLayersOfAStartHaveARowOfTheirOwn) {
  const TreeModel flat = TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, {at(0, 0)})}, {{}});
  const Plot plot =
      layer_plots("mine",
                  {{.conditions = {"flat"}, .policy = as_policy(flat), .demonstration = nullptr},
                   fitted(3)})
          .front();
  EXPECT_EQ(plot.height_px, 2 * 340 + 40);
  const std::size_t first = plot.commands.find("'tree, layer 1'");
  EXPECT_THAT(plot.commands.substr(first - 100, 100), HasSubstr("set origin 0.000000,0.000000;"));
}

TEST(LayerPlotTest, OfManySamplesSomeAreDrawn) {
  const Plot plot = layer_plots("mine", {fitted(100'000)}).front();
  EXPECT_LT(std::count(plot.data.begin(), plot.data.end(), '\n'), 2000);
  EXPECT_THAT(plot.data, HasSubstr("\n200 400\n400 800\n"));
}

TEST(LayerPlotTest, SeveralInputsAreLeftOut) {
  const Component component{1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  EXPECT_THAT(layer_plots("mine", {{.conditions = {"a"},
                                    .policy = as_policy(TreeModel::from_global(
                                        FrameKind::kCholesky, {Gmm(2, {component})}, {{}})),
                                    .demonstration = nullptr}}),
              IsEmpty());
}

}  // namespace
}  // namespace treeroll::report
