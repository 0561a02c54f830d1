#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/numbers/mirrored.h"
#include "common/policy/tree/theta_layout.h"
#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"

/// What each layout can reach from a given mixture, and what it cannot.
///
///   means               every mean
///   means_cholesky,     every mean, and every positive definite covariance with S_II and the
///   means_pourahmadi    variance of the outputs given the inputs of the mixture
///   reduced_cholesky,   the same with the means of the inputs as they are
///   reduced_pourahmadi
///
/// A positive definite matrix is S_II, the slope S_OI S_II^-1 and the variance, each freely
/// chosen: the layouts with psi hold the two diagonal blocks and reach every slope, once.
namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Inputs and all variables.
constexpr std::pair<int, int> kDims[] = {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 6}, {4, 6}, {1, 7}};

bool explores_input_means(ThetaLayout layout) {
  return layout == ThetaLayout::kMeansCholesky || layout == ThetaLayout::kMeansPourahmadi;
}

MatrixXd slope_in(const MatrixXd& s, int in) {
  return s.topLeftCorner(in, in).llt().solve(s.topRightCorner(in, s.rows() - in)).transpose();
}

/// Variance of the outputs given the inputs, (A-8).
MatrixXd around_line(const MatrixXd& s, int in) {
  const Eigen::Index out = s.rows() - in;
  return s.bottomRightCorner(out, out) - slope_in(s, in) * s.topRightCorner(in, out);
}

/// The covariance with the slope in place of its own.
MatrixXd with_slope(const MatrixXd& s, int in, const MatrixXd& slope) {
  const Eigen::Index out = s.rows() - in;
  const MatrixXd s_ii = s.topLeftCorner(in, in);
  MatrixXd result = s;
  result.bottomLeftCorner(out, in) = slope * s_ii;
  result.topRightCorner(in, out) = (slope * s_ii).transpose();
  result.bottomRightCorner(out, out) = around_line(s, in) + slope * s_ii * slope.transpose();
  return mirrored(result);
}

double smallest_variance(const MatrixXd& s) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(s).eigenvalues()[0];
}

TEST(ThetaReachTest, EveryPositiveDefiniteMatrixIsReachedFromAnyOtherWithItsDiagonalBlocks) {
  for (const ThetaLayout layout : kLayoutsWithPsi) {
    for (const auto& [in, dim] : kDims) {
      for (const double condition : {10., 1e4, 1e8}) {
        for (std::uint32_t number = 0; number < 10; ++number) {
          SCOPED_TRACE(testing::Message()
                       << kThetaLayoutNames[static_cast<std::size_t>(layout)] << ", dI " << in
                       << ", d " << dim << ", condition " << condition << ", mixture " << number);
          test::RandomMixture random(number);
          const Component goal{1, random.vector(dim), random.covariance(dim, condition)};
          const int out = dim - in;
          Component start = goal;
          start.covariance = with_slope(
              goal.covariance, in, MatrixXd::NullaryExpr(out, in, [&] { return random.normal(); }));
          start.mean.tail(out) += random.vector(out);
          if (explores_input_means(layout)) start.mean.head(in) += random.vector(in);
          const Gmm reached =
              with_theta(layout, Gmm(in, {start}), to_theta(layout, Gmm(in, {goal})));
          // What is lost to rounding is relative to the matrix as a whole: to its largest variance,
          // 1. Its smallest is 1 / condition, and no more is lost of it.
          EXPECT_EQ(reached[0].mean, goal.mean);
          EXPECT_LT((reached[0].covariance - goal.covariance).norm(), 1e-14 * condition)
              << "start " << start.covariance.norm();
          if (condition < 1e8) {
            EXPECT_NEAR(smallest_variance(reached[0].covariance) * condition, 1, 1e-3);
          }
        }
      }
    }
  }
}

TEST(ThetaReachTest, EverySlopeIsReachedWhateverTheMatrix) {
  // Theta of any other mixture, whose diagonal blocks are its own: Pourahmadi's psi then gives the
  // slope where the outputs' own T is the same, so the slope is asked for through each layout.
  for (const ThetaLayout layout : kLayoutsWithPsi) {
    for (const auto& [in, dim] : kDims) {
      for (const double condition : {10., 1e6}) {
        test::RandomMixture random(41);
        const Component start{1, random.vector(dim), random.covariance(dim, condition)};
        const MatrixXd slope =
            MatrixXd::NullaryExpr(dim - in, in, [&] { return 3 * random.normal(); });
        Component wanted = start;
        wanted.covariance = with_slope(start.covariance, in, slope);
        const Gmm reached =
            with_theta(layout, Gmm(in, {start}), to_theta(layout, Gmm(in, {wanted})));
        EXPECT_LT((slope_in(reached[0].covariance, in) - slope).norm(), 1e-14 * condition * 100)
            << kThetaLayoutNames[static_cast<std::size_t>(layout)] << ", dI " << in << ", d "
            << dim;
      }
    }
  }
}

TEST(ThetaReachTest, NoThetaLeavesTheDiagonalBlocksOrPositiveDefiniteness) {
  for (const ThetaLayout layout : kLayoutsWithPsi) {
    for (const auto& [in, dim] : kDims) {
      for (std::uint32_t number = 0; number < 20; ++number) {
        test::RandomMixture random(number);
        const Component start{1, random.vector(dim), random.covariance(dim, 1e3)};
        const VectorXd theta = 10 * random.vector(theta_dim_per_component(layout, in, dim - in));
        const Gmm moved = with_theta(layout, Gmm(in, {start}), theta);
        const MatrixXd& s = moved[0].covariance;
        EXPECT_EQ(s, s.transpose());
        EXPECT_GT(smallest_variance(s), 0) << number;
        EXPECT_EQ(s.topLeftCorner(in, in), start.covariance.topLeftCorner(in, in));
        EXPECT_LT((around_line(s, in) - around_line(start.covariance, in)).norm(), 1e-12 * s.norm())
            << number;
        if (!explores_input_means(layout)) {
          EXPECT_EQ(moved[0].mean.head(in), start.mean.head(in));
        }
      }
    }
  }
}

TEST(ThetaReachTest, MeansReachEveryMeanAndNoOtherCovariance) {
  for (const auto& [in, dim] : kDims) {
    test::RandomMixture random(42);
    const Gmm start = random.gmm(in, dim, 3);
    const Gmm goal = random.gmm(in, dim, 3);
    const Gmm reached = with_theta(ThetaLayout::kMeans, start, to_theta(ThetaLayout::kMeans, goal));
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(reached[k].mean, goal[k].mean);
      EXPECT_EQ(reached[k].covariance, start[k].covariance);
    }
  }
}

}  // namespace
}  // namespace treeroll
