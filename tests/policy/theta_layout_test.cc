#include "common/policy/theta_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "common/policy/frame.h"
#include "common/policy/gmr.h"
#include "tests/policy/random_mixture.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ThetaLayout kLayouts[] = {ThetaLayout::kMeans, ThetaLayout::kMeansCholesky};

TEST(ThetaLayoutTest, HasTheCorrectedNumberOfElements) {
  // Thesis (3-10), corrected: with the means of the inputs explored too, dI + dO + dI dO.
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeans, 1, 1), 2);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeansCholesky, 1, 1), 3);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeansCholesky, 2, 3), 11);
}

TEST(ThetaLayoutTest, ListsTheMeanAndThenPsiRowByRow) {
  MatrixXd factor(3, 3);
  factor << 2, 0, 0, 5, 3, 0, 7, 11, 4;
  const Component component{1, Eigen::Vector3d(-1, -2, -3), factor * factor.transpose()};
  EXPECT_THAT(to_theta(ThetaLayout::kMeansCholesky, Gmm(1, {component})),
              ::testing::ElementsAre(-1, -2, -3, 5, 7));
  const VectorXd two_inputs = to_theta(ThetaLayout::kMeansCholesky, Gmm(2, {component}));
  EXPECT_LT((two_inputs - (VectorXd(5) << -1, -2, -3, 7, 11).finished()).norm(), 1e-14);
}

TEST(ThetaLayoutTest, RoundTripsBothWays) {
  for (const ThetaLayout layout : kLayouts) {
    for (std::uint32_t number = 0; number < 20; ++number) {
      test::RandomMixture random(number);
      for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
        const Gmm gmm = random.gmm(in, dim, 3);
        EXPECT_LT(test::distance(with_theta(layout, gmm, to_theta(layout, gmm)), gmm), 1e-13);
        const VectorXd theta = random.vector(3 * theta_dim_per_component(layout, in, dim - in));
        EXPECT_LT((to_theta(layout, with_theta(layout, gmm, theta)) - theta).norm(), 1e-12);
      }
    }
  }
}

TEST(ThetaLayoutTest, LeavesPhiAsItWas) {
  test::RandomMixture random(1);
  const Gmm gmm = random.gmm(2, 4, 2);
  const Gmm moved = with_theta(ThetaLayout::kMeansCholesky, gmm, random.vector(16));
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(moved[k].prior, gmm[k].prior);
    const MatrixXd before = cholesky_factor(gmm[k].covariance);
    const MatrixXd after = cholesky_factor(moved[k].covariance);
    EXPECT_EQ(after.topLeftCorner(2, 2), before.topLeftCorner(2, 2));
    EXPECT_LT((after - before).bottomRightCorner(2, 2).norm(), 1e-13);
  }
}

TEST(ThetaLayoutTest, SetsTheSlopeOfARegressionToPsiOverZeta) {
  const Component component{1, Eigen::Vector2d(0, 0), Eigen::Vector2d(4, 9).asDiagonal()};
  const Gmm gmm =
      with_theta(ThetaLayout::kMeansCholesky, Gmm(1, {component}), Eigen::Vector3d(0, 0, .5));
  EXPECT_NEAR(Gmr(gmm).regress(1), .5 / 2, 1e-15);
}

TEST(ThetaLayoutTest, RefusesAThetaThatLeavesNoMixture) {
  const Gmm gmm = test::RandomMixture(1).gmm(1, 2, 1);
  for (const double extreme : {1e30, 1e300}) {
    EXPECT_THROW(with_theta(ThetaLayout::kMeansCholesky, gmm, Eigen::Vector3d(0, 0, extreme)),
                 std::invalid_argument);
  }
  EXPECT_THROW(with_theta(ThetaLayout::kMeans, gmm, Eigen::Vector2d(1e300, 0)),
               std::invalid_argument);
}

}  // namespace
}  // namespace treeroll
