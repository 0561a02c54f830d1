#include "common/policy/tree/sensitivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "common/mixture/gmr.h"
#include "tests/explore/trees.h"

namespace treeroll::explore {
namespace {

TEST(SensitivityTest, OfOneGaussianIsTheSlopeOfALine) {
  // u = mu_O + A (t - mu_I), A = psi / zeta = 3: du/dmu_I = -3, du/dmu_O = 1, du/dpsi = (t - mu_I)
  // / zeta, whose mean square over -1.5, -1, .., 1.5 deviations is 1.
  const double zeta = .5;
  const double psi = 1.5;
  Eigen::Matrix2d covariance;
  covariance << zeta * zeta, psi * zeta, psi * zeta, psi * psi + .1;
  const Gmm gmm(1, {{1, Eigen::Vector2d(2, 7), covariance}});
  const TreePolicy policy{TreeModel::from_global(FrameKind::kCholesky, {gmm}, {{}}), 1,
                          ThetaLayout::kMeansCholesky};
  EXPECT_TRUE(sensitivity_scale(policy).isApprox(Eigen::Vector3d(1. / 3, 1, 1), 1e-6))
      << sensitivity_scale(policy).transpose();
}

TEST(SensitivityTest, StepsOfThatLengthMoveTheOutputAlike) {
  const TreePolicy policy{explore::two_layer_tree(), 1, ThetaLayout::kMeansCholesky};
  const Eigen::VectorXd scale = sensitivity_scale(policy);
  ASSERT_EQ(scale.size(), 6);
  EXPECT_TRUE((scale.array() > 0).all() && scale.allFinite());
  // All outputs of this tree are 0: moving a Gaussian in time changes nothing, and counts as moving
  // the spread of the output within half its deviation.
  const Gmm gmm = policy.tree().layer(1);
  const double spread = std::sqrt(policy.tree().finest()[0].covariance(1, 1));
  EXPECT_NEAR(scale[0], .5 * std::sqrt(gmm[0].covariance(0, 0)) / spread, 1e-9);
  EXPECT_NEAR(scale[1], scale[4], 1e-6 * scale[1]) << "the two halves mirror each other";
}

TEST(SensitivityTest, IsInTheUnitsOfTheOutput) {
  const auto scale_with = [](double unit) {
    Gmm gmm = explore::spaced_gmm(3);
    std::vector<Component> components = gmm.components();
    for (std::size_t k = 0; k < 3; ++k) {
      components[k].mean[1] = unit * (1. + static_cast<double>(k * k));
      components[k].covariance(1, 1) *= unit * unit;
    }
    return sensitivity_scale(
        {TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, components)}, {{}}), 1,
         ThetaLayout::kMeans});
  };
  const Eigen::VectorXd ones = scale_with(1);
  const Eigen::VectorXd tens = scale_with(10);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(tens[2 * k], ones[2 * k] / 10, 1e-5 * ones[2 * k]);
    EXPECT_NEAR(tens[2 * k + 1], ones[2 * k + 1], 1e-5 * ones[2 * k + 1]);
  }
}

/// The output is the sum of the inputs everywhere, so the mean of the outputs tells where the cloud
/// of inputs lies: around the means, whatever share of its points is taken.
TEST(SensitivityTest, AThinnedCloudLiesAroundItsGaussians) {
  const auto around = [](int num_inputs, int num_components) {
    const int dim = num_inputs + 1;
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(dim, dim);
    covariance.bottomRows(1).setOnes();
    covariance.rightCols(1).setOnes();
    covariance(dim - 1, dim - 1) = num_inputs + .1;
    Eigen::VectorXd mean = Eigen::VectorXd::Ones(dim);
    mean[dim - 1] = num_inputs;
    const std::vector<Component> components(static_cast<std::size_t>(num_components),
                                            {1. / num_components, mean, covariance});
    // One number a mean is explored: what lies below is what acts.
    return TreePolicy(TreeModel::from_global(
                          FrameKind::kCholesky,
                          {Gmm(num_inputs, {{1, mean, covariance}}), Gmm(num_inputs, components)},
                          {{}, std::vector<int>(static_cast<std::size_t>(num_components), 0)}),
                      1, ThetaLayout::kMeans);
  };
  for (const auto& [num_inputs, num_components] :
       {std::pair{2, 30}, std::pair{2, 64}, std::pair{8, 32}, std::pair{8, 64}}) {
    const PolicyEffect effect = around(num_inputs, num_components).effect();
    EXPECT_LE(effect.outputs.rows(), 512);
    EXPECT_GE(effect.outputs.rows(), 256);
    EXPECT_NEAR(effect.outputs.mean(), num_inputs, .05) << num_inputs << " " << num_components;
  }
}

}  // namespace
}  // namespace treeroll::explore
