#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/mixture/gmm.h"
#include "common/numbers/mirrored.h"
#include "common/numbers/random_stream.h"
#include "common/policy/tree/tree_model.h"

namespace treeroll::test {

/// Arbitrary but repeatable mixtures and trees for laws that hold for all of them.
class RandomMixture {
 public:
  explicit RandomMixture(std::uint32_t number)
      : stream_(7, number, 0, RandomPurpose::kPopulation) {}

  double normal() { return stream_.next_normal(); }
  /// From 0 to `limit` - 1.
  int below(int limit) { return static_cast<int>(stream_.next_uniform() * limit); }

  Eigen::VectorXd vector(int size) {
    return Eigen::VectorXd::NullaryExpr(size, [this] { return normal(); });
  }

  /// Full rank and well conditioned.
  Eigen::MatrixXd covariance(int dim) {
    const Eigen::MatrixXd root =
        Eigen::MatrixXd::NullaryExpr(dim, dim, [this] { return normal(); });
    return root * root.transpose() + .2 * Eigen::MatrixXd::Identity(dim, dim);
  }

  /// Orthogonal.
  Eigen::MatrixXd orthogonal(int dim) {
    const Eigen::MatrixXd any = Eigen::MatrixXd::NullaryExpr(dim, dim, [this] { return normal(); });
    return Eigen::HouseholderQR<Eigen::MatrixXd>(any).householderQ();
  }

  /// Any axes, variances from 1 down to 1 / condition, evenly apart in their logarithms.
  Eigen::MatrixXd covariance(int dim, double condition) {
    const Eigen::MatrixXd axes = orthogonal(dim);
    Eigen::VectorXd variances(dim);
    for (int i = 0; i < dim; ++i) variances[i] = std::pow(condition, -i / (dim - 1.));
    return mirrored(axes * variances.asDiagonal() * axes.transpose());
  }

  Component component(int dim) {
    const double prior = .1 + stream_.next_uniform();
    Eigen::VectorXd mean = 3 * vector(dim);
    return {prior, std::move(mean), covariance(dim)};
  }

  Gmm gmm(int input_dim, int dim, int num_components) {
    std::vector<Component> components;
    for (int k = 0; k < num_components; ++k) components.push_back(component(dim));
    return Gmm(input_dim, std::move(components));
  }

  /// Two components in layer 1, each with two children in the layer below.
  TreeModel tree(FrameKind kind, int input_dim, int dim, int num_layers) {
    std::vector<Gmm> layers;
    std::vector<std::vector<int>> parents;
    for (int layer = 0; layer < num_layers; ++layer) {
      const int num_components = 2 << layer;
      layers.push_back(gmm(input_dim, dim, num_components));
      parents.emplace_back();
      for (int k = 0; layer > 0 && k < num_components; ++k) parents.back().push_back(k / 2);
    }
    return TreeModel::from_global(kind, std::move(layers), std::move(parents));
  }

  /// Two components in layer 1; in a layer below each has any Gaussian above as its parent, so that
  /// some have no children, some one, some many, and no two of a kind are side by side.
  TreeModel uneven_tree(FrameKind kind, int input_dim, int dim, int num_layers) {
    std::vector<Gmm> layers;
    std::vector<std::vector<int>> parents;
    for (int layer = 0; layer < num_layers; ++layer) {
      const int num_components = 2 + 3 * layer;
      parents.emplace_back();
      for (int k = 0; layer > 0 && k < num_components; ++k) {
        parents.back().push_back(below(layers.back().num_components()));
      }
      layers.push_back(gmm(input_dim, dim, num_components));
    }
    return TreeModel::from_global(kind, std::move(layers), std::move(parents));
  }

 private:
  RandomStream stream_;
};

/// Largest difference of two mixtures in any number.
inline double distance(const Gmm& a, const Gmm& b) {
  double largest = a.num_components() == b.num_components() ? 0 : 1e300;
  for (int k = 0; largest < 1e300 && k < a.num_components(); ++k) {
    largest = std::max(largest, std::abs(a[k].prior - b[k].prior));
    largest = std::max(largest, (a[k].mean - b[k].mean).cwiseAbs().maxCoeff());
    largest = std::max(largest, (a[k].covariance - b[k].covariance).cwiseAbs().maxCoeff());
  }
  return largest;
}

}  // namespace treeroll::test
