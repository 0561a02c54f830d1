#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/policy/tree/frame.h"
#include "common/policy/tree/tree_policy.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// What a text may hold; a policy is a small thing.
constexpr std::size_t kLayersMax = 16;
constexpr std::size_t kComponentsMax = 4096;
constexpr std::size_t kDimMax = 32;

// Words in the order of the enumerations.
const std::vector<const char*> kFrameWords = {"eigenvector", "cholesky"};
const std::vector<const char*> kLayoutWords = [] {
  std::vector<const char*> words;
  for (const std::string_view name : kThetaLayoutNames) words.push_back(name.data());
  return words;
}();

json lower_triangle(const Eigen::MatrixXd& matrix) {
  json list = json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column <= row; ++column) list.push_back(matrix(row, column));
  }
  return list;
}

json node_to_json(const TreeModel::Node& node, bool with_axes) {
  json out;
  out["parent"] = node.parent;
  out["prior"] = node.local.prior;
  out["mean"] = std::vector<double>(node.local.mean.begin(), node.local.mean.end());
  out["covariance"] = lower_triangle(node.local.covariance);
  if (with_axes) {
    json axes = json::array();
    for (Eigen::Index row = 0; row < node.frame.rows(); ++row) {
      for (Eigen::Index column = 0; column < node.frame.cols(); ++column) {
        axes.push_back(node.frame(row, column));
      }
    }
    out["axes"] = std::move(axes);
  }
  return out;
}

TreeModel::Node read_node(const PolicyText& place, bool with_axes) {
  std::set<std::string> keys = {"parent", "prior", "mean", "covariance"};
  if (with_axes) keys.insert("axes");
  place.need_keys(keys);
  TreeModel::Node node;
  node.parent = place.at("parent").integer(-1, static_cast<int>(kComponentsMax) - 1);
  node.local.prior = place.at("prior").number();

  const PolicyText mean = place.at("mean");
  const std::size_t size = mean.list_size(2, kDimMax);
  const auto dim = static_cast<Eigen::Index>(size);
  node.local.mean.resize(dim);
  for (std::size_t i = 0; i < size; ++i) {
    node.local.mean[static_cast<Eigen::Index>(i)] = mean.at(i).number();
  }

  const PolicyText covariance = place.at("covariance");
  covariance.list_size(size * (size + 1) / 2, size * (size + 1) / 2);
  node.local.covariance.resize(dim, dim);
  std::size_t next = 0;
  for (Eigen::Index row = 0; row < dim; ++row) {
    for (Eigen::Index column = 0; column <= row; ++column) {
      const double number = covariance.at(next++).number();
      node.local.covariance(row, column) = number;
      node.local.covariance(column, row) = number;
    }
  }

  if (with_axes) {
    const PolicyText axes = place.at("axes");
    axes.list_size(size * size, size * size);
    node.frame.resize(dim, dim);
    for (std::size_t i = 0; i < size * size; ++i) {
      node.frame(static_cast<Eigen::Index>(i / size), static_cast<Eigen::Index>(i % size)) =
          axes.at(i).number();
    }
  }
  return node;
}

TreeModel read_tree(const PolicyText& policy) {
  const auto frame_kind = static_cast<FrameKind>(policy.at("frames").word(kFrameWords));
  const int input_dim = policy.at("input_dim").integer(1, static_cast<int>(kDimMax) - 1);
  const PolicyText layers = policy.at("layers");
  const std::size_t num_layers = layers.list_size(1, kLayersMax);
  std::vector<std::vector<TreeModel::Node>> nodes(num_layers);
  for (std::size_t i = 0; i < num_layers; ++i) {
    const PolicyText layer = layers.at(i);
    const std::size_t num_components = layer.list_size(1, kComponentsMax);
    const bool with_axes = frame_kind == FrameKind::kEigenvector && i + 1 < num_layers;
    for (std::size_t k = 0; k < num_components; ++k) {
      nodes[i].push_back(read_node(layer.at(k), with_axes));
    }
  }
  try {
    if (frame_kind == FrameKind::kEigenvector) {
      // Nothing hangs on the frames of the finest layer, so the text does not carry them. The rules
      // for a covariance are from_nodes's to check, but no eigenvectors exist without them.
      for (TreeModel::Node& node : nodes.back()) {
        const Gmm checked(input_dim, {{1, node.local.mean, node.local.covariance}});
        node.frame = principal_axes(checked[0].covariance);
      }
    }
    TreeModel tree = TreeModel::from_nodes(frame_kind, input_dim, std::move(nodes));
    // Valid in each frame does not mean valid in the global one.
    for (int layer = 1; layer <= tree.num_layers(); ++layer) static_cast<void>(tree.layer(layer));
    return tree;
  } catch (const std::invalid_argument& error) {
    throw PolicyTextError("layers:", error.what());
  }
}

}  // namespace

PolicyPtr tree_from_content(const PolicyText& content) {
  content.need_keys({"frames", "input_dim", "layer", "layers", "layout"});
  TreeModel tree = read_tree(content);
  const int layer = content.at("layer").integer(1, tree.num_layers());
  const auto layout = static_cast<ThetaLayout>(content.at("layout").word(kLayoutWords));
  return std::make_shared<TreePolicy>(std::move(tree), layer, layout);
}

json TreePolicy::content() const {
  json out;
  out["frames"] = kFrameWords[static_cast<std::size_t>(tree_.frame_kind())];
  out["input_dim"] = input_dim();
  out["layer"] = layer_;
  out["layout"] = kLayoutWords[static_cast<std::size_t>(layout_)];
  for (int layer = 1; layer <= num_layers(); ++layer) {
    const bool with_axes = tree_.frame_kind() == FrameKind::kEigenvector && layer < num_layers();
    json nodes = json::array();
    for (const TreeModel::Node& node : tree_.nodes(layer)) {
      nodes.push_back(node_to_json(node, with_axes));
    }
    out["layers"].push_back(std::move(nodes));
  }
  return out;
}

}  // namespace treeroll
