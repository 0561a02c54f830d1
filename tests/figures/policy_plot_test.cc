#include "learner/figures/policy_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <sstream>

namespace treeroll {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TreeModel one_gaussian(double mean_output) {
  Component component{1, Eigen::Vector2d(1, mean_output), Eigen::Matrix2d::Zero()};
  component.covariance << .25, .3, .3, 4;
  return TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, {component})}, {{}});
}

TEST(PolicyPlotTest, EllipsesAreTwoStandardDeviationsAround) {
  const Plot plot = policy_plot("mine", {{"flat", one_gaussian(3), std::nullopt}});
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
  const Plot plot = policy_plot("mine", {{"flat", one_gaussian(3), std::nullopt}});
  // Slope .3 / .25, from two deviations of .5 below the mean to two above.
  EXPECT_THAT(plot.data, HasSubstr("regression\n0 1.8"));
  EXPECT_THAT(plot.data, HasSubstr("\n2 4.2"));
  EXPECT_THAT(plot.commands, Not(HasSubstr("further layers")));
}

TEST(PolicyPlotTest, TheBestIsDrawnOverTheStart) {
  const Policy best{one_gaussian(5), 1, ThetaLayout::kMeansCholesky};
  const Plot plot = policy_plot("mine", {{"it's", one_gaussian(3), best}});
  EXPECT_THAT(plot.data, HasSubstr("regression\n0 3.8"));
  EXPECT_THAT(plot.commands, HasSubstr("set title 'it''s'"));
}

TEST(PolicyPlotTest, SeveralInputsAreNotDrawn) {
  const Component component{1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  const TreeModel tree = TreeModel::from_global(FrameKind::kCholesky, {Gmm(2, {component})}, {{}});
  EXPECT_THAT(policy_plot("mine", {{"flat", tree, std::nullopt}}).commands, IsEmpty());
}

}  // namespace
}  // namespace treeroll
