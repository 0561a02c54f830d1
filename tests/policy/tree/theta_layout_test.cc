#include "common/policy/tree/theta_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <stdexcept>

#include "common/mixture/gmr.h"
#include "common/policy/tree/frame.h"
#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// T and D of T S T^T = D, with T unit lower triangular, from the factor of S.
std::pair<MatrixXd, VectorXd> pourahmadi(const MatrixXd& covariance) {
  const MatrixXd factor = cholesky_factor(covariance);
  const MatrixXd unit = factor * factor.diagonal().cwiseInverse().asDiagonal();
  return {unit.inverse(), factor.diagonal().cwiseAbs2()};
}

/// The variance of the outputs given the inputs, (A-8).
MatrixXd conditional(const MatrixXd& s, int in) {
  const auto out = s.rows() - in;
  return s.bottomRightCorner(out, out) -
         s.bottomLeftCorner(out, in) *
             s.topLeftCorner(in, in).llt().solve(s.topRightCorner(in, out));
}

TEST(ThetaLayoutTest, HasTheCorrectedNumberOfElements) {
  // Thesis (3-10), corrected: with the means of the inputs explored too, dI + dO + dI dO.
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeans, 1, 1), 2);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeansCholesky, 1, 1), 3);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeansCholesky, 2, 3), 11);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kMeansPourahmadi, 2, 3), 11);
  // dO (dI + 1).
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kReducedCholesky, 1, 2), 4);
  EXPECT_EQ(theta_dim_per_component(ThetaLayout::kReducedPourahmadi, 2, 3), 9);
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

TEST(ThetaLayoutTest, ListsTheOutputsMeansAloneWhereReduced) {
  MatrixXd factor(3, 3);
  factor << 2, 0, 0, 5, 3, 0, 7, 11, 4;
  const Component component{1, Eigen::Vector3d(-1, -2, -3), factor * factor.transpose()};
  EXPECT_THAT(to_theta(ThetaLayout::kReducedCholesky, Gmm(1, {component})),
              ::testing::ElementsAre(-2, -3, 5, 7));
}

TEST(ThetaLayoutTest, CholeskyGivesTheCovarianceOfEquationA30) {
  // psi_1 and psi_2 are theta's for one input and two outputs; psi_3 and all zeta are phi's.
  const double z1 = 1.5, z2 = .7, z3 = 1.2, psi1 = .4, psi2 = -.9, psi3 = .6;
  Eigen::Matrix3d l;
  l << z1, 0, 0, 0, z2, 0, 0, psi3, z3;  // with the explored psi still 0
  const Component start{1, Eigen::Vector3d::Zero(), l * l.transpose()};
  const Gmm gmm = with_theta(ThetaLayout::kMeansCholesky, Gmm(1, {start}),
                             (VectorXd(5) << 0, 0, 0, psi1, psi2).finished());
  Eigen::Matrix3d expected;
  expected << z1 * z1, psi1 * z1, psi2 * z1,
      psi1 * z1, psi1 * psi1 + z2 * z2, psi1 * psi2 + psi3 * z2,
      psi2 * z1, psi1 * psi2 + psi3 * z2, psi2 * psi2 + psi3 * psi3 + z3 * z3;
  EXPECT_LT((gmm[0].covariance - expected).norm(), 1e-14);
}

TEST(ThetaLayoutTest, CholeskysPsiFollowsTheRecursionOfA23) {
  // L_ij = (S_ij - sum_{k<j} L_ik L_jk) / L_jj, column by column, as it stands.
  for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
    test::RandomMixture random(4);
    const Gmm gmm = random.gmm(in, dim, 1);
    const MatrixXd& s = gmm[0].covariance;
    MatrixXd l = MatrixXd::Zero(dim, dim);
    for (int j = 0; j < dim; ++j) {
      for (int i = j; i < dim; ++i) {
        double rest = s(i, j);
        for (int k = 0; k < j; ++k) rest -= l(i, k) * l(j, k);
        l(i, j) = i == j ? std::sqrt(rest) : rest / l(j, j);
      }
    }
    const VectorXd theta = to_theta(ThetaLayout::kMeansCholesky, gmm);
    int next = dim;
    for (int i = in; i < dim; ++i) {
      for (int j = 0; j < in; ++j) EXPECT_NEAR(theta[next++], l(i, j), 1e-12);
    }
    EXPECT_EQ(next, theta.size());
  }
}

TEST(ThetaLayoutTest, PourahmadisPsiPredictsEachVariableFromThoseBeforeIt) {
  // the coefficients of the best linear prediction of an output from the inputs and from
  // the outputs before it; theta holds those of the inputs.
  for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {2, 5}}) {
    test::RandomMixture random(5);
    const Gmm gmm = random.gmm(in, dim, 1);
    const MatrixXd& s = gmm[0].covariance;
    const VectorXd theta = to_theta(ThetaLayout::kMeansPourahmadi, gmm);
    for (int row = in; row < dim; ++row) {
      const VectorXd coefficients = s.topLeftCorner(row, row).llt().solve(s.col(row).head(row));
      for (int column = 0; column < in; ++column) {
        EXPECT_NEAR(theta[dim + (row - in) * in + column], coefficients[column], 1e-12);
      }
    }
  }
}

TEST(ThetaLayoutTest, PourahmadiGivesTheCovarianceOfEquationA28) {
  // psi_1 and psi_2 are theta's for one input and two outputs; psi_3 and all zeta are phi's.
  const double z1 = 1.5, z2 = .7, z3 = 1.2, psi1 = .4, psi2 = -.9, psi3 = .6;
  Eigen::Matrix3d t;
  t << 1, 0, 0, 0, 1, 0, 0, -psi3, 1;  // with the explored psi still 0
  const MatrixXd inverse = t.inverse();
  const Eigen::Vector3d d(z1 * z1, z2 * z2, z3 * z3);
  const Component start{1, Eigen::Vector3d::Zero(), inverse * d.asDiagonal() * inverse.transpose()};
  const Gmm gmm = with_theta(ThetaLayout::kMeansPourahmadi, Gmm(1, {start}),
                             (VectorXd(5) << 0, 0, 0, psi1, psi2).finished());
  const double s13 = z1 * z1 * (psi2 + psi1 * psi3);
  const double s23 = z1 * z1 * (psi3 * psi1 * psi1 + psi2 * psi1) + z2 * z2 * psi3;
  const double s33 = z1 * z1 * (psi1 * psi1 * psi3 * psi3 + 2 * psi1 * psi2 * psi3 + psi2 * psi2) +
                     z2 * z2 * psi3 * psi3 + z3 * z3;
  Eigen::Matrix3d expected;
  expected << z1 * z1, z1 * z1 * psi1, s13,                  //
      z1 * z1 * psi1, z1 * z1 * psi1 * psi1 + z2 * z2, s23,  // the print says zeta_x for zeta_1
      s13, s23, s33;
  EXPECT_LT((gmm[0].covariance - expected).norm(), 1e-14);
}

TEST(ThetaLayoutTest, PourahmadisPsiIsTheNegativeBlockOfT) {
  test::RandomMixture random(3);
  const Gmm gmm = random.gmm(2, 5, 1);
  const auto [t, d] = pourahmadi(gmm[0].covariance);
  const VectorXd theta = to_theta(ThetaLayout::kReducedPourahmadi, gmm);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 2; ++column) {
      EXPECT_NEAR(theta[3 + 2 * row + column], -t(2 + row, column), 1e-12);
    }
  }
  // And all else of T and D is phi.
  const auto [t_moved, d_moved] =
      pourahmadi(with_theta(ThetaLayout::kReducedPourahmadi, gmm, random.vector(9))[0].covariance);
  EXPECT_LT((t_moved - t).topLeftCorner(2, 2).norm(), 1e-12);
  EXPECT_LT((t_moved - t).bottomRightCorner(3, 3).norm(), 1e-12);
  EXPECT_LT((d_moved - d).norm(), 1e-11);
}

TEST(ThetaLayoutTest, ReachesEveryPositiveDefiniteMatrixWithItsDiagonalBlocks) {
  for (const ThetaLayout layout : kLayoutsWithPsi) {
    for (std::uint32_t number = 0; number < 20; ++number) {
      test::RandomMixture random(number);
      for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
        // Any positive definite matrix is the goal; the start shares S_II and the variance of the
        // outputs given the inputs with it, and has nothing between inputs and outputs.
        const Component goal = random.component(dim);
        const int out = dim - in;
        Component start = goal;
        start.covariance.setZero();
        start.covariance.topLeftCorner(in, in) = goal.covariance.topLeftCorner(in, in);
        const MatrixXd rest = conditional(goal.covariance, in);
        start.covariance.bottomRightCorner(out, out) = (rest + rest.transpose()) / 2;
        start.mean.tail(out).setZero();
        const Gmm wanted(in, {goal});
        const Gmm reached = with_theta(layout, Gmm(in, {start}), to_theta(layout, wanted));
        EXPECT_LT(test::distance(reached, wanted), 1e-11 * (1 + goal.covariance.norm()));
      }
    }
  }
}

TEST(ThetaLayoutTest, EveryPsiKeepsTheInputsAndTheVarianceGivenThem) {
  for (const ThetaLayout layout : kLayoutsWithPsi) {
    test::RandomMixture random(5);
    const Gmm gmm = random.gmm(2, 4, 2);
    const Gmm moved =
        with_theta(layout, gmm, random.vector(2 * theta_dim_per_component(layout, 2, 2)));
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(moved[k].covariance.topLeftCorner(2, 2), gmm[k].covariance.topLeftCorner(2, 2));
      EXPECT_LT((conditional(moved[k].covariance, 2) - conditional(gmm[k].covariance, 2)).norm(),
                1e-12);
    }
  }
}

TEST(ThetaLayoutTest, TheReducedLayoutsLeaveTheMeansOfTheInputsAlone) {
  for (const ThetaLayout layout :
       {ThetaLayout::kReducedCholesky, ThetaLayout::kReducedPourahmadi}) {
    test::RandomMixture random(6);
    const Gmm gmm = random.gmm(2, 4, 1);
    const VectorXd theta = random.vector(6);
    const Gmm moved = with_theta(layout, gmm, theta);
    EXPECT_EQ(moved[0].mean.head(2), gmm[0].mean.head(2));
    EXPECT_EQ(moved[0].mean.tail(2), theta.head(2));
  }
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

TEST(ThetaLayoutTest, TakesPourahmadisPsiAsTheSlopeOfARegression) {
  const Component component{1, Eigen::Vector2d(0, 0), Eigen::Vector2d(4, 9).asDiagonal()};
  const Gmm gmm =
      with_theta(ThetaLayout::kReducedPourahmadi, Gmm(1, {component}), Eigen::Vector2d(0, .5));
  EXPECT_NEAR(Gmr(gmm).regress(1), .5, 1e-15);
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
