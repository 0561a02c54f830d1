#include "common/policy/tree/experience.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/mixture/gmr.h"
#include "common/numbers/mirrored.h"
#include "common/numbers/random_stream.h"
#include "tests/explore/trees.h"
#include "tests/policy/tree/every_layout.h"

namespace treeroll {
namespace {

RandomStream stream(int seed) {
  return {static_cast<std::uint64_t>(seed), 0, 0, RandomPurpose::kPerturbation};
}

Eigen::VectorXd normal_vector(RandomStream& random, Eigen::Index size) {
  Eigen::VectorXd vector(size);
  for (double& element : vector) element = random.next_normal();
  return vector;
}

Gmm random_gmm(RandomStream& random, int num_inputs, int num_outputs, int num_components) {
  const int dim = num_inputs + num_outputs;
  std::vector<Component> components;
  for (int k = 0; k < num_components; ++k) {
    Eigen::MatrixXd factor(dim, dim + 2);
    for (int i = 0; i < factor.cols(); ++i) factor.col(i) = normal_vector(random, dim);
    components.push_back(
        {1. + k, 2 * normal_vector(random, dim), mirrored(factor * factor.transpose() / dim)});
  }
  return {num_inputs, std::move(components)};
}

/// Three layers of 2, 4 and 8 Gaussians.
TreeModel random_tree(RandomStream& random, FrameKind frames, int num_inputs, int num_outputs) {
  std::vector<Gmm> layers;
  for (const int k : {2, 4, 8}) layers.push_back(random_gmm(random, num_inputs, num_outputs, k));
  return TreeModel::from_global(frames, std::move(layers),
                                {{}, {0, 0, 1, 1}, {0, 0, 1, 1, 2, 2, 3, 3}});
}

Eigen::MatrixXd slope_of(const Component& component, int num_inputs) {
  const Eigen::Index num_outputs = component.mean.size() - num_inputs;
  return component.covariance.topLeftCorner(num_inputs, num_inputs)
      .llt()
      .solve(component.covariance.topRightCorner(num_inputs, num_outputs))
      .transpose();
}

/// The next layer, seen through the projected theta, has the linear map of each component that the
/// roll-out had there.
void expect_linear_maps_kept(const TreePolicy& left, RandomStream& random) {
  const int num_inputs = left.tree().input_dim();
  const int num_outputs = left.tree().dim() - num_inputs;
  const Eigen::VectorXd mean = left.theta() + .1 * normal_vector(random, left.theta_dim());
  const Eigen::VectorXd rollout = mean + .3 * normal_vector(random, left.theta_dim());
  const TreePolicy next{left.tree_with(mean), left.layer() + 1, left.layout()};
  const auto theta = project_experience(left, next, rollout);
  ASSERT_TRUE(theta);

  const Gmm acted = left.tree_with(rollout).layer(next.layer());
  const Gmm acts = next.tree_with(*theta).layer(next.layer());
  const Gmm before = next.tree().layer(next.layer());
  for (int k = 0; k < acted.num_components(); ++k) {
    const Eigen::MatrixXd expected = slope_of(acted[k], num_inputs);
    const Eigen::MatrixXd slope = slope_of(acts[k], num_inputs);
    const double size = 1 + expected.norm();
    EXPECT_LT((slope - expected).norm(), 1e-9 * size);
    const Eigen::VectorXd offset =
        acts[k].mean.tail(num_outputs) - slope * acts[k].mean.head(num_inputs);
    const Eigen::VectorXd offset_expected =
        acted[k].mean.tail(num_outputs) - expected * acted[k].mean.head(num_inputs);
    EXPECT_LT((offset - offset_expected).norm(), 1e-9 * size * (1 + acted[k].mean.norm()));
    // The input variance is not theta's, and has moved between mean and roll-out.
    EXPECT_TRUE(acts[k]
                    .covariance.topLeftCorner(num_inputs, num_inputs)
                    .isApprox(before[k].covariance.topLeftCorner(num_inputs, num_inputs), 1e-9));
  }
}

TEST(ExperienceTest, KeepsTheLinearMapOfEachComponent) {
  for (const FrameKind frames : {FrameKind::kEigenvector, FrameKind::kCholesky}) {
    for (const ThetaLayout layout : kLayoutsWithPsi) {
      for (const auto& [num_inputs, num_outputs] :
           {std::pair(1, 1), std::pair(2, 1), std::pair(1, 2), std::pair(3, 2)}) {
        for (int seed = 0; seed < 10; ++seed) {
          for (const int layer : {1, 2}) {
            SCOPED_TRACE(testing::Message() << kThetaLayoutNames[static_cast<std::size_t>(layout)]
                                            << ", dI " << num_inputs << ", dO " << num_outputs
                                            << ", seed " << seed << ", layer " << layer);
            RandomStream random = stream(seed);
            expect_linear_maps_kept(
                {random_tree(random, frames, num_inputs, num_outputs), layer, layout}, random);
          }
        }
      }
    }
  }
}

TEST(ExperienceTest, KeepsTheWholeCurveWhereTheInputVariancesStandStill) {
  for (int seed = 0; seed < 20; ++seed) {
    RandomStream random = stream(seed);
    // Means alone: no covariance of the layer left moves, so no frame turns.
    std::vector<TreePolicy> policies{
        {random_tree(random, FrameKind::kEigenvector, 2, 2), 2, ThetaLayout::kMeans}};
    // Cholesky frames: the factor's input block is not explored, so the children's input
    // variances stay although their couplings move.
    for (const ThetaLayout layout : kLayoutsWithPsi) {
      policies.push_back({random_tree(random, FrameKind::kCholesky, 2, 2), 2, layout});
    }
    for (const TreePolicy& left : policies) {
      const Eigen::VectorXd mean = left.theta() + .2 * normal_vector(random, left.theta_dim());
      const Eigen::VectorXd rollout = mean + normal_vector(random, left.theta_dim());
      const TreePolicy next{left.tree_with(mean), 3, left.layout()};
      const auto theta = project_experience(left, next, rollout);
      ASSERT_TRUE(theta);
      const Gmr acted(left.decode(rollout));
      const Gmr acts(next.decode(*theta));
      for (int i = 0; i < 20; ++i) {
        const Eigen::VectorXd input = 3 * normal_vector(random, 2);
        const Eigen::VectorXd expected = acted.regress(input);
        EXPECT_LT((acts.regress(input) - expected).norm(), 1e-8 * (1 + expected.norm()))
            << seed << " " << kThetaLayoutNames[static_cast<std::size_t>(left.layout())];
      }
    }
  }
}

TEST(ExperienceTest, TheMeanProjectsToTheNextLayersStart) {
  RandomStream random = stream(3);
  const TreePolicy left{random_tree(random, FrameKind::kEigenvector, 2, 1), 1,
                        ThetaLayout::kMeansCholesky};
  const Eigen::VectorXd mean = left.theta() + .2 * normal_vector(random, left.theta_dim());
  const TreePolicy next{left.tree_with(mean), 2, left.layout()};
  EXPECT_LT((*project_experience(left, next, mean) - next.theta()).norm(), 1e-9);
}

TEST(ExperienceTest, HasNothingWhereNoMixtureRepresentsTheRollout) {
  const TreePolicy left{explore::two_layer_tree(), 1, ThetaLayout::kMeansCholesky};
  const TreePolicy next{explore::two_layer_tree(), 2, ThetaLayout::kMeansCholesky};
  Eigen::VectorXd extreme = left.theta();
  extreme[0] = 1e60;
  EXPECT_FALSE(project_experience(left, next, extreme));
  EXPECT_TRUE(project_experience(left, next, left.theta()));
}

}  // namespace
}  // namespace treeroll
