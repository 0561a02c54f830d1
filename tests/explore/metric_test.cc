#include "learner/explore/metric.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/explore/trees.h"

namespace treeroll::explore {
namespace {

LinearPolicy spline(int num_outputs) {
  Eigen::MatrixXd coefficients(num_outputs, 8);
  for (Eigen::Index i = 0; i < coefficients.size(); ++i) {
    coefficients.data()[i] = static_cast<double>(i % 5) - 2;
  }
  return {std::make_shared<SplineForm>(std::make_shared<SplineLadder>(BSpline(3, 8, 0, 2.2), 1),
                                       nullptr),
          coefficients, 1};
}

/// What a step of theta does to the output: root of the mean over inputs of its squared norm.
double moved(const PolicyEffect& effect, const Eigen::VectorXd& step) {
  return (effect.derivative * step).norm() / std::sqrt(effect.outputs.rows());
}

TEST(MetricTest, AStepOfEachElementMovesTheOutputAlike) {
  const PolicyEffect effect = spline(2).effect();
  const Eigen::MatrixXd covariance = step_covariance(effect, Metric::kDiagonal, 1);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    const Eigen::VectorXd step =
        std::sqrt(covariance(i, i)) * Eigen::VectorXd::Unit(covariance.rows(), i);
    EXPECT_NEAR(moved(effect, step), 1, 1e-12) << i;
  }
}

TEST(MetricTest, AStepInAnyDirectionMovesTheOutputAlike) {
  const PolicyEffect effect = spline(2).effect();
  const Eigen::MatrixXd factor = step_covariance(effect, Metric::kFull, 1).llt().matrixL();
  for (Eigen::Index i = 0; i < factor.cols(); ++i) {
    EXPECT_NEAR(moved(effect, factor.col(i)), 1, .02) << i;  // a thousandth is added
  }
}

TEST(MetricTest, IsInTheUnitOfTheOutputAndOfTheirSize) {
  const LinearPolicy policy = spline(1);
  const PolicyEffect effect = policy.effect();
  EXPECT_NEAR(output_size(effect), output_size(policy.with(3 * policy.theta())->effect()) / 3,
              1e-12);
  PolicyEffect larger = effect;
  larger.derivative *= 10;
  EXPECT_TRUE(step_covariance(larger, Metric::kFull, 1)
                  .isApprox(step_covariance(effect, Metric::kFull, 1) / 100, 1e-9));
}

/// The outputs of this tree are all 0: to move a Gaussian in time moves nothing.
TEST(MetricTest, NeverStepsFarBecauseNothingMoves) {
  for (const int layer : {1, 2}) {
    const TreePolicy policy{two_layer_tree(), layer, ThetaLayout::kMeansCholesky};
    const PolicyEffect effect = policy.effect();
    EXPECT_EQ(output_size(effect), 0);
    const Gmm gmm = policy.tree().layer(layer);
    for (const Metric metric : {Metric::kDiagonal, Metric::kFull}) {
      const Eigen::MatrixXd covariance = step_covariance(effect, metric, 2);
      for (int k = 0; k < gmm.num_components(); ++k) {
        const double deviation = std::sqrt(gmm[k].covariance(0, 0));
        // By half a deviation, for the whole scale of the output.
        EXPECT_LE(2 * std::sqrt(covariance(3 * k, 3 * k)), .51 * deviation);
        EXPECT_GT(2 * std::sqrt(covariance(3 * k, 3 * k)), .2 * deviation);
      }
    }
  }
}

TEST(MetricTest, ATreesEffectIsThatOfItsSteps) {
  Gmm gmm = spaced_gmm(3);
  std::vector<Component> components = gmm.components();
  for (std::size_t k = 0; k < 3; ++k) components[k].mean[1] = static_cast<double>(k * k) - 1;
  const TreePolicy policy{TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, components)}, {{}}),
                          1, ThetaLayout::kMeansCholesky};
  const PolicyEffect effect = policy.effect();
  Eigen::VectorXd step = Eigen::VectorXd::LinSpaced(9, -1e-4, 1e-4);
  for (int k = 0; k < 3; ++k) step[3 * k] = 0;  // the inputs follow Gaussians that move in time
  const PolicyEffect there = policy.with(policy.theta() + step)->effect();
  EXPECT_EQ(effect.derivative.rows(), effect.outputs.size());
  EXPECT_NEAR((there.outputs.col(0) - effect.outputs.col(0) - effect.derivative * step).norm(), 0,
              1e-3 * (effect.derivative * step).norm());
  EXPECT_EQ(effect.least[0], 2 / std::sqrt(components[0].covariance(0, 0)));
  EXPECT_EQ(effect.least[1], 0);
  EXPECT_EQ(effect.least[2], 0);
}

}  // namespace
}  // namespace treeroll::explore
