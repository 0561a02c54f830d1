#include "common/policy/tree/tree_model.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"
#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

/// How far stored axes may be from a rotation to the principal axes: rounding, and no more.
constexpr double kFrameTolerance = 1e-9;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

[[noreturn]] void refuse(int layer, const std::string& rule) {
  throw std::invalid_argument(fmt::format("layer {}: {}", layer, rule));
}

void check_parents(int layer, const std::vector<int>& parents, int num_components, int num_above) {
  const int expected = layer == 1 ? 0 : num_components;
  if (static_cast<int>(parents.size()) != expected) {
    refuse(layer, fmt::format("there are {} parents, must be {}", parents.size(), expected));
  }
  for (std::size_t k = 0; k < parents.size(); ++k) {
    if (parents[k] >= 0 && parents[k] < num_above) continue;
    refuse(layer, fmt::format("component {}: the parent is {}, must be from 0 to {}", k, parents[k],
                              num_above - 1));
  }
}

/// The stored frame of an eigenvector tree is data from outside: as good as computed, or refused.
void check_axes(int layer, std::size_t component, const TreeModel::Node& node) {
  const Eigen::Index dim = node.local.mean.size();
  const auto fail = [&](const char* rule) {
    refuse(layer, fmt::format("component {}: the frame {}", component, rule));
  };
  const Eigen::MatrixXd& axes = node.frame;
  if (axes.rows() != dim || axes.cols() != dim) fail("must be d x d");
  if (!axes.allFinite()) fail("must be finite");
  const Eigen::MatrixXd excess = axes.transpose() * axes - Eigen::MatrixXd::Identity(dim, dim);
  if (excess.cwiseAbs().maxCoeff() > kFrameTolerance || axes.determinant() < 0) {
    fail("must be a rotation");
  }
  const Eigen::MatrixXd turned = axes.transpose() * node.local.covariance * axes;
  const double largest = turned.diagonal().maxCoeff();
  for (Eigen::Index i = 0; i < dim; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      if (std::abs(turned(i, j)) > kFrameTolerance * largest) {
        fail("must point along the principal axes of the covariance");
      }
    }
  }
}

}  // namespace

TreeModel TreeModel::from_global(FrameKind frame_kind, std::vector<Gmm> layers,
                                 std::vector<std::vector<int>> parents) {
  if (layers.empty()) throw std::invalid_argument("a tree needs at least one layer");
  if (parents.size() != layers.size()) {
    throw std::invalid_argument(fmt::format("there are parents for {} layers, must be for {}",
                                            parents.size(), layers.size()));
  }
  TreeModel tree(frame_kind, layers[0].input_dim(), {});
  for (int layer = 1; layer <= static_cast<int>(layers.size()); ++layer) {
    const Gmm& gmm = layers[index(layer - 1)];
    if (gmm.dim() != layers[0].dim() || gmm.input_dim() != layers[0].input_dim()) {
      refuse(layer, "the dimensions must be those of layer 1");
    }
    const std::vector<int>& parents_here = parents[index(layer - 1)];
    check_parents(layer, parents_here, gmm.num_components(),
                  layer == 1 ? 0 : tree.num_components(layer - 1));
    tree.layers_.emplace_back();
    const std::vector<Frame> frames = tree.frames_above(layer);
    for (int k = 0; k < gmm.num_components(); ++k) {
      Node node;
      node.parent = layer == 1 ? -1 : parents_here[index(k)];
      node.local = layer == 1 ? gmm[k] : tree.to_local(frames[index(node.parent)], gmm[k]);
      node.frame = frame_kind == FrameKind::kCholesky ? cholesky_factor(node.local.covariance)
                                                      : principal_axes(node.local.covariance);
      tree.layers_.back().push_back(std::move(node));
    }
  }
  return tree;
}

TreeModel TreeModel::from_nodes(FrameKind frame_kind, int input_dim,
                                std::vector<std::vector<Node>> layers) {
  if (layers.empty()) throw std::invalid_argument("a tree needs at least one layer");
  for (int layer = 1; layer <= static_cast<int>(layers.size()); ++layer) {
    std::vector<Node>& nodes = layers[index(layer - 1)];
    std::vector<int> parents;
    std::vector<Component> components;
    for (const Node& node : nodes) {
      if (layer == 1 && node.parent != -1) refuse(layer, "a component of layer 1 has no parent");
      if (layer > 1) parents.push_back(node.parent);
      components.push_back(node.local);
    }
    try {
      // A mixture of the local Gaussians makes no sense as a policy, but obeys the same rules.
      const Gmm checked(input_dim, components);
      if (checked.dim() != static_cast<int>(layers[0][0].local.mean.size())) {
        throw std::invalid_argument("the dimension must be that of layer 1");
      }
      for (int k = 0; k < checked.num_components(); ++k) nodes[index(k)].local = checked[k];
    } catch (const std::invalid_argument& error) {
      refuse(layer, error.what());
    }
    check_parents(layer, parents, static_cast<int>(nodes.size()),
                  layer == 1 ? 0 : static_cast<int>(layers[index(layer - 2)].size()));
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (frame_kind == FrameKind::kCholesky) {
        nodes[k].frame = cholesky_factor(nodes[k].local.covariance);
      } else {
        check_axes(layer, k, nodes[k]);
      }
    }
  }
  return TreeModel(frame_kind, input_dim, std::move(layers));
}

const std::vector<TreeModel::Node>& TreeModel::nodes(int layer) const {
  CHECK(layer >= 1 && layer <= num_layers(), "a layer is from 1 to num_layers()");
  return layers_[index(layer - 1)];
}

std::vector<int> TreeModel::parents(int layer) const {
  std::vector<int> parents;
  if (layer == 1) return parents;
  for (const Node& node : nodes(layer)) parents.push_back(node.parent);
  return parents;
}

std::vector<TreeModel::Frame> TreeModel::frames_above(int layer) const {
  std::vector<Frame> frames;  // Empty stands for the global frame, above layer 1.
  for (int above = 1; above < layer; ++above) {
    std::vector<Frame> next;
    next.reserve(nodes(above).size());
    for (const Node& node : nodes(above)) {
      if (above == 1) {
        next.push_back({node.local.mean, node.frame});
        continue;
      }
      // (3-5): the chain of transformations from the global frame down.
      const Frame& parent = frames[index(node.parent)];
      next.push_back({parent.origin + parent.axes * node.local.mean, parent.axes * node.frame});
    }
    frames = std::move(next);
  }
  return frames;
}

Component TreeModel::to_local(const Frame& frame, const Component& global) const {
  Component local;
  local.prior = global.prior;
  if (frame_kind_ == FrameKind::kEigenvector) {
    local.mean = frame.axes.transpose() * (global.mean - frame.origin);
    local.covariance = mirrored(frame.axes.transpose() * global.covariance * frame.axes);
  } else {
    local.mean = frame.axes.triangularView<Eigen::Lower>().solve(global.mean - frame.origin);
    const Eigen::MatrixXd half = frame.axes.triangularView<Eigen::Lower>().solve(global.covariance);
    const Eigen::MatrixXd half_transposed = half.transpose();
    local.covariance = mirrored(frame.axes.triangularView<Eigen::Lower>().solve(half_transposed));
  }
  return local;
}

Gmm TreeModel::layer(int layer) const {
  const std::vector<Frame> frames = frames_above(layer);
  std::vector<Component> components;
  components.reserve(nodes(layer).size());
  for (const Node& node : nodes(layer)) {
    if (layer == 1) {
      components.push_back(node.local);
      continue;
    }
    const Frame& frame = frames[index(node.parent)];
    components.push_back({node.local.prior, frame.origin + frame.axes * node.local.mean,
                          mirrored(frame.axes * node.local.covariance * frame.axes.transpose())});
  }
  return Gmm(input_dim_, std::move(components));
}

TreeModel TreeModel::with_layer(int layer, const Gmm& gmm) const {
  if (gmm.num_components() != num_components(layer) || gmm.dim() != dim() ||
      gmm.input_dim() != input_dim_) {
    refuse(layer, "the new mixture must have the components and dimensions of the old one");
  }
  TreeModel tree = *this;
  const std::vector<Frame> frames = frames_above(layer);
  for (int k = 0; k < gmm.num_components(); ++k) {
    Node& node = tree.layers_[index(layer - 1)][index(k)];
    node.local = layer == 1 ? gmm[k] : to_local(frames[index(node.parent)], gmm[k]);
    node.frame = frame_kind_ == FrameKind::kCholesky
                     ? cholesky_factor(node.local.covariance)
                     : principal_axes(node.local.covariance, node.frame);
  }
  return tree;
}

}  // namespace treeroll
