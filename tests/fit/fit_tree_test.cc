#include "learner/fit/fit_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "learner/fit/demonstration.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::ElementsAre;

FitSettings thesis_settings() {
  FitSettings settings;
  settings.em.regularisation = Eigen::Vector2d(1e-3, 1);
  return settings;
}

/// All of a mixture in one Gaussian.
Component merged(const Gmm& gmm) {
  Component sum = gmm[0];
  for (int k = 1; k < gmm.num_components(); ++k) sum = merge(sum, gmm[k]);
  return sum;
}

TEST(FitTreeTest, FitsTheSwingUpDemonstration) {
  const Eigen::MatrixXd data = demonstrate({});
  const FitSettings settings = thesis_settings();
  const TreeModel flat = fit_flat(data, 4, settings);
  const TreeModel tree = fit_bottom_up(data, 2, 2, settings);
  // Thesis section 4-3-1: flat fits the demonstration better than the tree's second layer. These
  // mixtures are the ones whose roll-outs have the rewards .391, .280 and .253.
  EXPECT_NEAR(mean_log_likelihood(flat.finest(), data), -2.9552, 1e-3);
  EXPECT_NEAR(mean_log_likelihood(tree.finest(), data), -3.1797, 1e-3);
  EXPECT_NEAR(mean_log_likelihood(tree.layer(1), data), -3.8364, 1e-3);
}

TEST(FitTreeTest, GivesEachGaussianTwoChildrenThatShareItsPrior) {
  const Eigen::MatrixXd data = demonstrate({});
  const TreeModel tree = fit_bottom_up(data, 2, 3, thesis_settings());
  ASSERT_EQ(tree.num_layers(), 3);
  EXPECT_THAT(tree.parents(2), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(tree.parents(3), ElementsAre(0, 0, 1, 1, 2, 2, 3, 3));
  for (int layer = 1; layer < 3; ++layer) {
    const Gmm parents = tree.layer(layer);
    const Gmm children = tree.layer(layer + 1);
    for (int p = 0; p < parents.num_components(); ++p) {
      EXPECT_NEAR(children[2 * p].prior + children[2 * p + 1].prior, parents[p].prior, 1e-6);
    }
    EXPECT_GT(mean_log_likelihood(children, data), mean_log_likelihood(parents, data));
  }
}

TEST(FitTreeTest, GivesTheFirstLayerTheFitOfAFlatModel) {
  const Eigen::MatrixXd data = demonstrate({});
  const FitSettings settings = thesis_settings();
  EXPECT_EQ(test::distance(fit_bottom_up(data, 2, 2, settings).layer(1),
                           fit_flat(data, 2, settings).finest()),
            0);
}

/// Two Gaussians cannot meet these curves, so that their refinement goes on until they cancel one
/// another, far from all samples: one has no share of them by its density.
TEST(FitTreeTest, SplitsALayerWhoseRefinementHasLeftTheData) {
  constexpr int kSamples = 100;
  Eigen::MatrixXd data(2, kSamples);
  for (int n = 0; n < kSamples; ++n) {
    const double t = 2. * n / (kSamples - 1);
    data.col(n) << t, 2 * std::sin(3 * t) + .5 * t;
  }
  FitSettings settings;
  settings.em.regularisation = Eigen::Vector2d(3.400673400673403e-05, 0.00014746999148645943);
  settings.initial_output_deviation = 1.214372230769707;
  settings.refine.emplace();
  const TreeModel tree = fit_bottom_up(data, 2, 2, settings);
  const Gmm above = tree.layer(1);
  ASSERT_LT(responsibilities(above, data).rowwise().sum().minCoeff(), 1) << "it has stayed";
  EXPECT_LT(relative_regression_error(tree.finest(), data), .1);
}

TEST(FitTreeTest, MergesFromTheFlatModelUpwards) {
  const Eigen::MatrixXd data = demonstrate({});
  for (const FrameKind kind : {FrameKind::kEigenvector, FrameKind::kCholesky}) {
    FitSettings settings = thesis_settings();
    settings.frame_kind = kind;
    const Gmm flat = fit_flat(data, 8, settings).finest();
    const TreeModel tree = fit_top_down(data, 8, 4, settings);
    ASSERT_EQ(tree.num_layers(), 4);
    EXPECT_EQ(tree.frame_kind(), kind);
    EXPECT_EQ(tree.num_components(1), 1);
    EXPECT_THAT(tree.parents(2), ElementsAre(0, 0));
    const Component whole = merged(flat);
    for (int layer = 1; layer <= 4; ++layer) {
      const Gmm gmm = tree.layer(layer);
      EXPECT_EQ(gmm.num_components(), 1 << (layer - 1));
      EXPECT_LT(test::distance(Gmm(1, {merged(gmm)}), Gmm(1, {whole})), 1e-9) << layer;
      for (int k = 1; k < gmm.num_components(); ++k) {
        EXPECT_GT(gmm[k].mean[0], gmm[k - 1].mean[0]) << "neighbours in time are merged";
      }
    }
  }
}

TEST(FitTreeTest, KeepsTheFirstLayerOfAOneLayerTree) {
  const Eigen::MatrixXd data = demonstrate({});
  EXPECT_EQ(fit_bottom_up(data, 3, 1, thesis_settings()).num_layers(), 1);
  EXPECT_EQ(fit_top_down(data, 3, 1, thesis_settings()).num_layers(), 1);
}

}  // namespace
}  // namespace treeroll
