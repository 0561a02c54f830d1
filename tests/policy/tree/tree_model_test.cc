#include "common/policy/tree/tree_model.h"
#include "common/numbers/mirrored.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "common/policy/tree/frame.h"
#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// A rotation of `dim` dimensions by some angle in the plane of the first and the last.
MatrixXd rotation_by(int dim, double angle) {
  MatrixXd rotation = MatrixXd::Identity(dim, dim);
  rotation(0, 0) = rotation(dim - 1, dim - 1) = std::cos(angle);
  rotation(dim - 1, 0) = std::sin(angle);
  rotation(0, dim - 1) = -std::sin(angle);
  return rotation;
}

/// The mixture after the motion x -> map (x - centre) + centre + shift.
Component moved(const Component& c, const MatrixXd& map, const VectorXd& centre,
                const VectorXd& shift) {
  return {c.prior, map * (c.mean - centre) + centre + shift,
          mirrored(map * c.covariance * map.transpose())};
}

TEST(TreeModelTest, GivesBackItsLayersInTheGlobalFrame) {
  for (const FrameKind kind : kFrameKinds) {
    for (std::uint32_t number = 0; number < 10; ++number) {
      for (const int dim : {2, 3, 4}) {
        test::RandomMixture random(number);
        const Gmm top = random.gmm(1, dim, 2);
        const Gmm middle = random.gmm(1, dim, 3);
        const Gmm bottom = random.gmm(1, dim, 4);
        const TreeModel tree =
            TreeModel::from_global(kind, {top, middle, bottom}, {{}, {0, 1, 1}, {2, 0, 0, 1}});
        EXPECT_EQ(tree.num_layers(), 3);
        EXPECT_THAT(tree.parents(3), ::testing::ElementsAre(2, 0, 0, 1));
        EXPECT_EQ(test::distance(tree.layer(1), top), 0);
        EXPECT_LT(test::distance(tree.layer(2), middle), 1e-11);
        EXPECT_LT(test::distance(tree.finest(), bottom), 1e-10);
      }
    }
  }
}

TEST(TreeModelTest, MovesAllDescendantsRigidlyWithAGaussian) {
  for (const int dim : {2, 3}) {
    test::RandomMixture random(11);
    const TreeModel tree = random.tree(FrameKind::kEigenvector, 1, dim, 3);
    const Gmm top = tree.layer(1);
    const MatrixXd rotation = rotation_by(dim, .4);
    const VectorXd shift = random.vector(dim);
    const VectorXd centre = top[0].mean;
    std::vector<Component> components = top.components();
    components[0] = moved(top[0], rotation, centre, shift);
    const TreeModel after = tree.with_layer(1, Gmm(1, components));
    for (const int layer : {2, 3}) {
      const Gmm before_gmm = tree.layer(layer);
      const Gmm after_gmm = after.layer(layer);
      std::vector<Component> expected = before_gmm.components();
      for (int k = 0; k < before_gmm.num_components() / 2; ++k) {
        expected[static_cast<std::size_t>(k)] = moved(before_gmm[k], rotation, centre, shift);
      }
      EXPECT_LT(test::distance(after_gmm, Gmm(1, expected)), 1e-10) << dim << " " << layer;
    }
  }
}

TEST(TreeModelTest, StretchesAllDescendantsWithTheCholeskyFactor) {
  for (const int dim : {2, 3}) {
    test::RandomMixture random(12);
    const TreeModel tree = random.tree(FrameKind::kCholesky, 1, dim, 3);
    const Gmm top = tree.layer(1);
    std::vector<Component> components = top.components();
    components[1].mean += random.vector(dim);
    components[1].covariance = random.covariance(dim);
    const TreeModel after = tree.with_layer(1, Gmm(1, components));
    const MatrixXd map =
        cholesky_factor(components[1].covariance) * cholesky_factor(top[1].covariance).inverse();
    const VectorXd shift = components[1].mean - top[1].mean;
    for (const int layer : {2, 3}) {
      const Gmm before_gmm = tree.layer(layer);
      std::vector<Component> expected = before_gmm.components();
      for (int k = before_gmm.num_components() / 2; k < before_gmm.num_components(); ++k) {
        expected[static_cast<std::size_t>(k)] = moved(before_gmm[k], map, top[1].mean, shift);
      }
      EXPECT_LT(test::distance(after.layer(layer), Gmm(1, expected)), 1e-9) << dim << " " << layer;
    }
  }
}

TEST(TreeModelTest, DoesNotFlipTheChildrenWhenTheParentsEigenvectorsChangeSign) {
  // Turned past the angle where the canonical sign of the first axis changes, in steps: a child
  // ahead of its parent stays ahead.
  test::RandomMixture random(13);
  const Gmm parent(1, {{1, Eigen::Vector2d(0, 0), Eigen::Vector2d(4, 1).asDiagonal()}});
  const Gmm child(1, {{1, Eigen::Vector2d(1, 0), Eigen::Vector2d(1, .5).asDiagonal()}});
  TreeModel tree = TreeModel::from_global(FrameKind::kEigenvector, {parent, child}, {{}, {0}});
  for (int step = 1; step <= 24; ++step) {
    const MatrixXd rotation = rotation_by(2, step * M_PI / 12);
    const Component turned{1, Eigen::Vector2d(0, 0),
                           rotation * parent[0].covariance * rotation.transpose()};
    tree = tree.with_layer(1, Gmm(1, {turned}));
    EXPECT_LT((tree.finest()[0].mean - rotation * child[0].mean).norm(), 1e-12) << step;
  }
}

TEST(TreeModelTest, LeavesTheLayersAboveAndTheOtherBranchesAlone) {
  for (const FrameKind kind : kFrameKinds) {
    test::RandomMixture random(14);
    const TreeModel tree = random.tree(kind, 1, 3, 3);
    std::vector<Component> components = tree.layer(2).components();
    components[0] = random.component(3);
    const TreeModel after = tree.with_layer(2, Gmm(1, components));
    EXPECT_EQ(test::distance(after.layer(1), tree.layer(1)), 0);
    EXPECT_LT(test::distance(after.layer(2), Gmm(1, components)), 1e-11);
    for (int k = 2; k < 8; ++k) {
      EXPECT_LT((after.layer(3)[k].mean - tree.layer(3)[k].mean).norm(), 1e-10) << k;
    }
    EXPECT_GT((after.layer(3)[0].mean - tree.layer(3)[0].mean).norm(), 1e-3);
  }
}

TEST(TreeModelTest, RefusesWhatIsNoTree) {
  test::RandomMixture random(15);
  const Gmm one = random.gmm(1, 2, 1);
  const Gmm two = random.gmm(1, 2, 2);
  const auto refusal = [](std::vector<Gmm> layers, std::vector<std::vector<int>> parents) {
    try {
      TreeModel::from_global(FrameKind::kEigenvector, std::move(layers), std::move(parents));
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal({one, two}, {{}, {0, 0}}), "");
  EXPECT_THAT(refusal({}, {}), HasSubstr("at least one layer"));
  EXPECT_THAT(refusal({one, two}, {{}}), HasSubstr("parents for 1 layers, must be for 2"));
  EXPECT_THAT(refusal({one, two}, {{}, {0}}), HasSubstr("layer 2: there are 1 parents, must be 2"));
  EXPECT_THAT(refusal({one}, {{0}}), HasSubstr("layer 1: there are 1 parents, must be 0"));
  EXPECT_THAT(refusal({one, two}, {{}, {0, 1}}), HasSubstr("component 1: the parent is 1"));
  EXPECT_THAT(refusal({one, two}, {{}, {-1, 0}}), HasSubstr("component 0: the parent is -1"));
  EXPECT_THAT(refusal({one, random.gmm(1, 3, 1)}, {{}, {0}}), HasSubstr("layer 2: the dimensions"));
  EXPECT_THAT(refusal({random.gmm(1, 3, 1), random.gmm(2, 3, 1)}, {{}, {0}}),
              HasSubstr("layer 2: the dimensions"));
  const TreeModel tree = TreeModel::from_global(FrameKind::kEigenvector, {one, two}, {{}, {0, 0}});
  EXPECT_THROW(tree.with_layer(2, one), std::invalid_argument);
  EXPECT_THROW(tree.with_layer(2, random.gmm(1, 3, 2)), std::invalid_argument);
}

}  // namespace
}  // namespace treeroll
