#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/numbers/mirrored.h"
#include "common/policy/tree/frame.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"

/// Laws of trees of three layers, with any number of children, in several dimensions.
namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kNumLayers = 3;

/// x -> map (x - from) + to.
struct Motion {
  MatrixXd map;
  VectorXd from;
  VectorXd to;

  Component operator()(const Component& c) const {
    return {c.prior, map * (c.mean - from) + to, mirrored(map * c.covariance * map.transpose())};
  }
};

/// For each component of `layer`: does it hang on component k of layer `above`, at any depth?
std::vector<bool> descends(const TreeModel& tree, int layer, int above, int k) {
  std::vector<bool> result(static_cast<std::size_t>(tree.num_components(above)), false);
  result[static_cast<std::size_t>(k)] = true;
  for (int below = above + 1; below <= layer; ++below) {
    std::vector<bool> next;
    for (const int parent : tree.parents(below)) {
      next.push_back(result[static_cast<std::size_t>(parent)]);
    }
    result = std::move(next);
  }
  return result;
}

/// The tree with another Gaussian in place of component k of `layer`.
TreeModel with_component(const TreeModel& tree, int layer, int k, const Component& component) {
  const Gmm gmm = tree.layer(layer);
  std::vector<Component> components = gmm.components();
  components[static_cast<std::size_t>(k)] = component;
  return tree.with_layer(layer, Gmm(gmm.input_dim(), std::move(components)));
}

/// All descendants of component k of `moved_layer` made the motion, and nothing else has moved.
void expect_moved(const TreeModel& before, const TreeModel& after, int moved_layer, int k,
                  const Motion& motion, double tolerance) {
  int num_descendants = 0;
  for (int layer = 1; layer <= before.num_layers(); ++layer) {
    if (layer == moved_layer) continue;
    std::vector<Component> expected = before.layer(layer).components();
    if (layer > moved_layer) {
      const std::vector<bool> is_below = descends(before, layer, moved_layer, k);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        if (!is_below[i]) continue;
        expected[i] = motion(expected[i]);
        ++num_descendants;
      }
    }
    EXPECT_LT(test::distance(after.layer(layer), Gmm(before.input_dim(), expected)), tolerance)
        << "layer " << layer;
  }
  EXPECT_GT(num_descendants, 0) << "a law about nothing";
}

/// A component of `layer` that has children; in layer 1 the one with the most.
int parent_of_many(const TreeModel& tree, int layer) {
  std::vector<int> counts(static_cast<std::size_t>(tree.num_components(layer)), 0);
  for (const int parent : tree.parents(layer + 1)) ++counts[static_cast<std::size_t>(parent)];
  return static_cast<int>(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

/// A rotation by `angle` in the plane of the first two columns of `basis`.
MatrixXd turn(const MatrixXd& basis, double angle) {
  MatrixXd rotation = MatrixXd::Identity(basis.rows(), basis.rows());
  rotation(0, 0) = rotation(1, 1) = std::cos(angle);
  rotation(1, 0) = std::sin(angle);
  rotation(0, 1) = -std::sin(angle);
  return basis * rotation * basis.transpose();
}

TEST(TreeLawsTest, DescendantsFollowEveryTurnAndShiftOfAGaussianRigidly) {
  // A whole turn in steps: the signs and the order of eigenvectors change on the way, and each
  // frame continues the one before it. A flip anywhere would put a child on the wrong side.
  constexpr int kSteps = 40;
  for (const int dim : {2, 3, 4}) {
    for (std::uint32_t number = 0; number < 6; ++number) {
      for (const int layer : {1, 2}) {
        SCOPED_TRACE(testing::Message()
                     << "mixture " << number << ", d " << dim << ", layer " << layer);
        test::RandomMixture random(number);
        const TreeModel start = random.uneven_tree(FrameKind::kEigenvector, 1, dim, kNumLayers);
        const int k = parent_of_many(start, layer);
        const Component gaussian = start.layer(layer)[k];
        const MatrixXd basis = random.orthogonal(dim);
        const VectorXd shift = random.vector(dim);
        TreeModel tree = start;
        for (int step = 1; step <= kSteps; ++step) {
          const double part = static_cast<double>(step) / kSteps;
          const Motion motion{turn(basis, 2 * M_PI * part), gaussian.mean,
                              gaussian.mean + part * shift};
          tree = with_component(tree, layer, k, motion(gaussian));
          expect_moved(start, tree, layer, k, motion, 1e-9);
        }
      }
    }
  }
}

TEST(TreeLawsTest, DescendantsStayRigidInSpaceWhileTheVariancesOfAGaussianPassEachOther) {
  // While it turns, its largest variance becomes its smallest; the axes keep their identity.
  constexpr int kSteps = 61;  // none of them at the crossings, where the axes are undefined
  for (std::uint32_t number = 0; number < 6; ++number) {
    for (const int layer : {1, 2}) {
      SCOPED_TRACE(testing::Message() << "mixture " << number << ", layer " << layer);
      test::RandomMixture random(number);
      TreeModel tree = random.uneven_tree(FrameKind::kEigenvector, 1, 3, kNumLayers);
      const int k = parent_of_many(tree, layer);
      const Component gaussian = tree.layer(layer)[k];
      const MatrixXd axes = random.orthogonal(3);
      const MatrixXd basis = random.orthogonal(3);
      const auto at = [&](double part) {
        const MatrixXd turned = turn(basis, 2 * part) * axes;
        const Eigen::Vector3d variances(4 - 3.5 * part, 2, 1 + 2.2 * part);
        return Component{gaussian.prior, gaussian.mean,
                         mirrored(turned * variances.asDiagonal() * turned.transpose())};
      };
      tree = with_component(tree, layer, k, at(0));
      const TreeModel start = tree;
      for (int step = 1; step <= kSteps; ++step) {
        const double part = static_cast<double>(step) / kSteps;
        tree = with_component(tree, layer, k, at(part));
        expect_moved(start, tree, layer, k, {turn(basis, 2 * part), gaussian.mean, gaussian.mean},
                     1e-9);
      }
    }
  }
}

TEST(TreeLawsTest, DescendantsKeepTheirShapesAndDistancesWhateverBecomesOfAGaussian) {
  // Not a turn but any other Gaussian: with eigenvector frames what hangs on it is one rigid body
  // all the same.
  for (const int dim : {2, 3, 5}) {
    for (std::uint32_t number = 0; number < 10; ++number) {
      SCOPED_TRACE(testing::Message() << "mixture " << number << ", d " << dim);
      test::RandomMixture random(number);
      const TreeModel tree = random.uneven_tree(FrameKind::kEigenvector, 1, dim, kNumLayers);
      const int k = parent_of_many(tree, 1);
      const TreeModel after = with_component(tree, 1, k, random.component(dim));
      std::vector<Component> were{tree.layer(1)[k]};
      std::vector<Component> are{after.layer(1)[k]};
      for (const int layer : {2, 3}) {
        const std::vector<bool> is_below = descends(tree, layer, 1, k);
        for (int i = 0; i < tree.num_components(layer); ++i) {
          if (!is_below[static_cast<std::size_t>(i)]) continue;
          were.push_back(tree.layer(layer)[i]);
          are.push_back(after.layer(layer)[i]);
        }
      }
      ASSERT_GT(were.size(), 3u);
      for (std::size_t i = 1; i < were.size(); ++i) {
        const auto variances = [](const Component& c) -> VectorXd {
          return Eigen::SelfAdjointEigenSolver<MatrixXd>(c.covariance).eigenvalues();
        };
        EXPECT_LT((variances(are[i]) - variances(were[i])).norm(), 1e-10);
        for (std::size_t j = 0; j < i; ++j) {
          EXPECT_NEAR((are[i].mean - are[j].mean).norm(), (were[i].mean - were[j].mean).norm(),
                      1e-10);
        }
      }
    }
  }
}

TEST(TreeLawsTest, DescendantsFollowTheCholeskyFactorOfAGaussian) {
  for (const int dim : {2, 3, 5}) {
    for (std::uint32_t number = 0; number < 10; ++number) {
      for (const int layer : {1, 2}) {
        SCOPED_TRACE(testing::Message()
                     << "mixture " << number << ", d " << dim << ", layer " << layer);
        test::RandomMixture random(number);
        const TreeModel tree = random.uneven_tree(FrameKind::kCholesky, 1, dim, kNumLayers);
        const int k = parent_of_many(tree, layer);
        const Component from = tree.layer(layer)[k];
        const Component to = random.component(dim);
        // L' L^-1, the factors those of the global covariances at any depth: the chain of the
        // frames' factors is the factor of the whole.
        const MatrixXd factor = cholesky_factor(from.covariance);
        const MatrixXd map = factor.transpose()
                                 .triangularView<Eigen::Upper>()
                                 .solve(cholesky_factor(to.covariance).transpose())
                                 .transpose();
        expect_moved(tree, with_component(tree, layer, k, to), layer, k, {map, from.mean, to.mean},
                     1e-8);
      }
    }
  }
}

TEST(TreeLawsTest, AGaussianThatMovesLeavesWhatIsStoredBelowItUntouched) {
  for (const FrameKind kind : kFrameKinds) {
    test::RandomMixture random(31);
    const TreeModel tree = random.uneven_tree(kind, 1, 3, kNumLayers);
    const TreeModel after = with_component(tree, 1, 0, random.component(3));
    for (const int layer : {2, 3}) {
      for (int i = 0; i < tree.num_components(layer); ++i) {
        const TreeModel::Node& was = tree.nodes(layer)[static_cast<std::size_t>(i)];
        const TreeModel::Node& is = after.nodes(layer)[static_cast<std::size_t>(i)];
        EXPECT_EQ(is.local.mean, was.local.mean);
        EXPECT_EQ(is.local.covariance, was.local.covariance);
        EXPECT_EQ(is.frame, was.frame);
      }
    }
  }
}

TEST(TreeLawsTest, ProjectsByTheProductOfTheHomogeneousMatrices) {
  // (3-2) to (3-5) as they stand: H of each ancestor from the global frame down.
  for (const FrameKind kind : kFrameKinds) {
    for (const int dim : {2, 3, 4}) {
      const TreeModel tree = test::RandomMixture(32).uneven_tree(kind, 1, dim, kNumLayers);
      const auto node = [&](int layer, int i) -> const TreeModel::Node& {
        return tree.nodes(layer)[static_cast<std::size_t>(i)];
      };
      const auto homogeneous = [&](const TreeModel::Node& of) {
        MatrixXd h = MatrixXd::Identity(dim + 1, dim + 1);
        h.topLeftCorner(dim, dim) = of.frame;
        h.topRightCorner(dim, 1) = of.local.mean;
        return h;
      };
      for (int i = 0; i < tree.num_components(3); ++i) {
        const int parent = node(3, i).parent;
        const MatrixXd h =
            homogeneous(node(1, node(2, parent).parent)) * homogeneous(node(2, parent));
        VectorXd mean(dim + 1);
        mean << node(3, i).local.mean, 1;
        const MatrixXd r = h.topLeftCorner(dim, dim);
        EXPECT_LT(((h * mean).head(dim) - tree.finest()[i].mean).norm(), 1e-11);
        EXPECT_LT(
            (r * node(3, i).local.covariance * r.transpose() - tree.finest()[i].covariance).norm(),
            1e-10);
      }
    }
  }
}

/// Inputs and all variables.
constexpr std::pair<int, int> kLawDims[] = {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 5}};

TEST(TreeLawsTest, ThetaToTreeToThetaGivesThetaBackForEveryLayoutAtEveryLayer) {
  for (const FrameKind kind : kFrameKinds) {
    for (const ThetaLayout layout : kLayouts) {
      for (const auto& [in, dim] : kLawDims) {
        for (int layer = 1; layer <= kNumLayers; ++layer) {
          for (std::uint32_t number = 0; number < 4; ++number) {
            SCOPED_TRACE(testing::Message()
                         << "mixture " << number << ", frames " << static_cast<int>(kind) << ", "
                         << kThetaLayoutNames[static_cast<std::size_t>(layout)] << ", dI " << in
                         << ", d " << dim << ", layer " << layer);
            test::RandomMixture random(number);
            TreePolicy policy{random.uneven_tree(kind, in, dim, kNumLayers), layer, layout};
            const TreeModel before = policy.tree();
            const VectorXd theta = policy.theta() + random.vector(policy.theta_dim());
            policy = TreePolicy(policy.tree_with(theta), layer, layout);
            EXPECT_LT((policy.theta() - theta).norm(), 1e-9 * (1 + theta.norm()));
            // The mixture is the one theta stands for, and the layers above have not felt it.
            const Gmm wanted = with_theta(layout, before.layer(layer), theta);
            EXPECT_LT(test::distance(policy.tree().layer(layer), wanted), 1e-9);
            for (int above = 1; above < layer; ++above) {
              EXPECT_EQ(test::distance(policy.tree().layer(above), before.layer(above)), 0);
            }
          }
        }
      }
    }
  }
}

TEST(TreeLawsTest, TreeToThetaToTreeGivesTheTreeBackForEveryLayoutAtEveryLayer) {
  for (const FrameKind kind : kFrameKinds) {
    for (const ThetaLayout layout : kLayouts) {
      for (const auto& [in, dim] : kLawDims) {
        for (int layer = 1; layer <= kNumLayers; ++layer) {
          const TreePolicy policy{test::RandomMixture(33).uneven_tree(kind, in, dim, kNumLayers),
                                  layer, layout};
          const TreeModel back = policy.tree_with(policy.theta());
          for (int i = 1; i <= kNumLayers; ++i) {
            EXPECT_LT(test::distance(back.layer(i), policy.tree().layer(i)), 1e-9)
                << static_cast<int>(kind) << " "
                << kThetaLayoutNames[static_cast<std::size_t>(layout)] << " " << in << " " << dim
                << " " << layer << " " << i;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace treeroll
