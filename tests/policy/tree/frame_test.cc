#include "common/policy/tree/frame.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;

void expect_principal(const MatrixXd& axes, const MatrixXd& covariance) {
  const Eigen::Index dim = covariance.rows();
  EXPECT_LT((axes.transpose() * axes - MatrixXd::Identity(dim, dim)).norm(), 1e-13);
  EXPECT_NEAR(axes.determinant(), 1, 1e-13);
  MatrixXd turned = axes.transpose() * covariance * axes;
  turned.diagonal().setZero();
  EXPECT_LT(turned.norm(), 1e-13 * covariance.norm());
}

TEST(FrameTest, IsARotationToThePrincipalAxes) {
  for (const int dim : {2, 3, 4, 6}) {
    for (std::uint32_t number = 0; number < 50; ++number) {
      test::RandomMixture random(number);
      const MatrixXd first = random.covariance(dim);
      const MatrixXd axes = principal_axes(first);
      expect_principal(axes, first);
      const MatrixXd second = random.covariance(dim);
      expect_principal(principal_axes(second, axes), second);
    }
  }
}

TEST(FrameTest, PutsTheLargestVarianceFirst) {
  const MatrixXd axes = principal_axes(Eigen::Vector3d(1, 9, 4).asDiagonal());
  EXPECT_EQ(axes.col(0).cwiseAbs(), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(principal_axes(Eigen::Vector2d(1, 9).asDiagonal()).col(0), Eigen::Vector2d(0, 1));
}

TEST(FrameTest, DoesNotFlipAsTheCovarianceTurns) {
  // A whole turn in small steps: the eigenvectors' own signs jump on the way, the frame does not,
  // and after half a turn it is upside down although the covariance is the old one.
  const MatrixXd start = Eigen::Vector2d(4, 1).asDiagonal();
  MatrixXd axes = principal_axes(start);
  const MatrixXd first = axes;
  constexpr int kSteps = 100;
  for (int i = 1; i <= kSteps; ++i) {
    const MatrixXd turn = Eigen::Rotation2Dd(2 * M_PI * i / kSteps).toRotationMatrix();
    axes = principal_axes(turn * start * turn.transpose(), axes);
    EXPECT_LT((axes - turn * first).norm(), 1e-12) << i;
  }
}

TEST(FrameTest, FollowsATurnInSpace) {
  const MatrixXd start = Eigen::Vector3d(9, 4, 1).asDiagonal();
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, .5).normalized();
  MatrixXd axes = principal_axes(start);
  const MatrixXd first = axes;
  for (int i = 1; i <= 100; ++i) {
    const MatrixXd turn = Eigen::AngleAxisd(2 * M_PI * i / 100, axis).toRotationMatrix();
    axes = principal_axes(turn * start * turn.transpose(), axes);
    EXPECT_LT((axes - turn * first).norm(), 1e-12) << i;
  }
}

TEST(FrameTest, KeepsItsAxesInSpaceWhenTheOrderOfTheVariancesChanges) {
  const MatrixXd before = principal_axes(Eigen::Vector3d(4, 1.01, 1).asDiagonal());
  const MatrixXd after = principal_axes(Eigen::Vector3d(4, 1, 1.01).asDiagonal(), before);
  EXPECT_LT((after - before).norm(), 1e-14);
}

TEST(FrameTest, StaysWhereACircleHasNoAxes) {
  const MatrixXd before = principal_axes(test::RandomMixture(5).covariance(2));
  EXPECT_EQ(principal_axes(MatrixXd::Identity(2, 2), before), before);
}

}  // namespace
}  // namespace treeroll
