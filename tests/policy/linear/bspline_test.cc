#include "common/policy/linear/bspline.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

std::vector<double> spread(double low, double high, int count) {
  std::vector<double> inputs;
  for (int n = 0; n < count; ++n) inputs.push_back(low + (high - low) * n / (count - 1));
  return inputs;
}

TEST(BSplineTest, SumsToOneEverywhereAndIsClampedAtItsEnds) {
  for (int degree = 0; degree <= 5; ++degree) {
    const BSpline spline(degree, degree + 4, -1, 2.5);
    const Eigen::MatrixXd values = spline.matrix(spread(-3, 4, 141));
    for (Eigen::Index n = 0; n < values.rows(); ++n) {
      EXPECT_NEAR(values.row(n).sum(), 1, 1e-14);
      EXPECT_GE(values.row(n).minCoeff(), 0);
    }
    const Eigen::MatrixXd ends = spline.matrix(std::array{-1., 2.5, -7., 9.});
    EXPECT_EQ(ends(0, 0), 1);
    EXPECT_EQ(ends(1, spline.size() - 1), 1);
    EXPECT_EQ(ends.row(2), ends.row(0));
    EXPECT_EQ(ends.row(3), ends.row(1));
  }
}

/// Coefficients at the Greville abscissae give the line through them.
TEST(BSplineTest, HoldsALine) {
  const BSpline spline(3, 9, 0, 2.2);
  Eigen::VectorXd greville(9);
  for (int i = 0; i < 9; ++i) {
    greville[i] = 0;
    for (int j = 1; j <= 3; ++j) greville[i] += spline.knots()[static_cast<std::size_t>(i + j)] / 3;
  }
  const std::vector<double> inputs = spread(0, 2.2, 57);
  const Eigen::VectorXd curve = spline.matrix(inputs) * greville;
  for (std::size_t n = 0; n < inputs.size(); ++n) {
    EXPECT_NEAR(curve[static_cast<Eigen::Index>(n)], inputs[n], 1e-14);
  }
}

TEST(BSplineTest, InsertionLeavesTheCurveAsItIs) {
  test::RandomMixture random(3);
  const std::vector<double> inputs = spread(0, 2.2, 301);
  for (int degree = 0; degree <= 5; ++degree) {
    BSpline spline(degree, degree + 1, 0, 2.2);
    Eigen::VectorXd coefficients = random.vector(spline.size());
    const Eigen::VectorXd before = spline.matrix(inputs) * coefficients;
    for (int spans = 2; spans <= 16; spans *= 2) {  // with degree 3: 4 -> 5 -> 7 -> 11 -> 19
      const Eigen::VectorXd finer = spline.insertion() * coefficients;
      coefficients = finer;
      spline = spline.refined();
      ASSERT_EQ(spline.num_spans(), spans);
      const Eigen::VectorXd after = spline.matrix(inputs) * coefficients;
      EXPECT_LT((after - before).cwiseAbs().maxCoeff(), 1e-14) << degree << " " << spans;
    }
  }
}

TEST(BSplineTest, InsertsByBoehmsRule) {
  // One span of a parabola is halved: de Casteljau.
  const Eigen::MatrixXd halved = BSpline(2, 3, 0, 1).insertion();
  Eigen::MatrixXd expected(4, 3);
  expected << 1, 0, 0, .5, .5, 0, 0, .5, .5, 0, 0, 1;
  EXPECT_EQ(halved, expected);
}

}  // namespace
}  // namespace treeroll
