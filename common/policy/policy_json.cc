#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "common/base/json_text.h"
#include "common/policy/frame.h"
#include "common/policy/policy.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "treeroll-policy";
constexpr int kVersion = 1;
/// policy > layers > layer > component > mean; parse depth counts from 0.
constexpr int kNestingMax = 5;

/// What a text may hold; a policy is a small thing.
constexpr std::size_t kTextBytesMax = std::size_t{1} << 20;
constexpr std::size_t kLayersMax = 16;
constexpr std::size_t kComponentsMax = 4096;
constexpr std::size_t kDimMax = 32;

/// A text that is no policy; leaves this file as an Error.
class Refusal : public std::runtime_error {
 public:
  Refusal(const std::string& place, const std::string& rule)
      : std::runtime_error(fmt::format("policy: {} {}", place, rule)) {}
};

std::string shown(const json& value) {
  constexpr std::size_t kLengthMax = 60;
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > kLengthMax) text = text.substr(0, kLengthMax) + "...";
  return text;
}

/// A value and where it stands: every refusal names the place.
struct Place {
  const json& value;
  std::string path;

  [[noreturn]] void refuse(const std::string& rule) const {
    throw Refusal(path, fmt::format("is {}: {}", shown(value), rule));
  }

  /// All keys and no others.
  void need_keys(const std::set<std::string>& keys) const {
    if (!value.is_object()) refuse("must be an object");
    for (const auto& [key, unused] : value.items()) {
      if (!keys.contains(key)) throw Refusal(path + "." + key, "is an unknown key");
    }
    for (const std::string& key : keys) {
      if (!value.contains(key)) throw Refusal(path + "." + key, "is required and missing");
    }
  }

  Place at(const char* key) const { return {value.at(key), path + "." + key}; }
  Place at(std::size_t i) const { return {value.at(i), fmt::format("{}[{}]", path, i)}; }

  std::size_t list_size(std::size_t min, std::size_t max) const {
    if (!value.is_array()) refuse("must be a list");
    if (value.size() < min || value.size() > max) {
      throw Refusal(path, min == max
                              ? fmt::format("holds {} elements, must hold {}", value.size(), min)
                              : fmt::format("holds {} elements, must hold from {} to {}",
                                            value.size(), min, max));
    }
    return value.size();
  }

  double number() const {
    if (!value.is_number()) refuse("must be a number");
    return value.get<double>();
  }

  int integer(int min, int max) const {
    // Through double: it holds every int and cannot wrap round.
    if (!value.is_number_integer() || !(value.get<double>() >= min && value.get<double>() <= max)) {
      refuse(fmt::format("must be an integer from {} to {}", min, max));
    }
    return value.get<int>();
  }

  std::size_t word(const std::vector<const char*>& words) const {
    for (std::size_t i = 0; value.is_string() && i < words.size(); ++i) {
      if (value.get_ref<const std::string&>() == words[i]) return i;
    }
    refuse(fmt::format("must be one of: {}", fmt::join(words, ", ")));
  }
};

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

TreeModel::Node read_node(const Place& place, bool with_axes) {
  std::set<std::string> keys = {"parent", "prior", "mean", "covariance"};
  if (with_axes) keys.insert("axes");
  place.need_keys(keys);
  TreeModel::Node node;
  node.parent = place.at("parent").integer(-1, static_cast<int>(kComponentsMax) - 1);
  node.local.prior = place.at("prior").number();

  const Place mean = place.at("mean");
  const std::size_t size = mean.list_size(2, kDimMax);
  const auto dim = static_cast<Eigen::Index>(size);
  node.local.mean.resize(dim);
  for (std::size_t i = 0; i < size; ++i) {
    node.local.mean[static_cast<Eigen::Index>(i)] = mean.at(i).number();
  }

  const Place covariance = place.at("covariance");
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
    const Place axes = place.at("axes");
    axes.list_size(size * size, size * size);
    node.frame.resize(dim, dim);
    for (std::size_t i = 0; i < size * size; ++i) {
      node.frame(static_cast<Eigen::Index>(i / size), static_cast<Eigen::Index>(i % size)) =
          axes.at(i).number();
    }
  }
  return node;
}

TreeModel read_tree(const Place& policy) {
  const auto frame_kind = static_cast<FrameKind>(policy.at("frames").word(kFrameWords));
  const int input_dim = policy.at("input_dim").integer(1, static_cast<int>(kDimMax) - 1);
  const Place layers = policy.at("layers");
  const std::size_t num_layers = layers.list_size(1, kLayersMax);
  std::vector<std::vector<TreeModel::Node>> nodes(num_layers);
  for (std::size_t i = 0; i < num_layers; ++i) {
    const Place layer = layers.at(i);
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
    throw Refusal("layers:", error.what());
  }
}

json parse(std::string_view text) {
  if (text.size() > kTextBytesMax) {
    throw Refusal("the text",
                  fmt::format("has {} bytes, must have at most {}", text.size(), kTextBytesMax));
  }
  Result<json> value = parse_json(text, kNestingMax);
  if (!value) throw Refusal("the text", value.error().message);
  return std::move(*value);
}

Policy read_policy(std::string_view text) {
  const json value = parse(text);
  const Place policy{value, "$"};
  // The version comes first: another version may have other keys.
  if (!value.is_object() || !value.contains("format") || value["format"] != kFormat) {
    throw Refusal("$.format", fmt::format("must be \"{}\"", kFormat));
  }
  if (!value.contains("version") || value["version"] != kVersion) {
    throw Refusal("$.version", fmt::format("must be {}", kVersion));
  }
  policy.need_keys({"format", "version", "frames", "input_dim", "layer", "layers", "layout"});
  TreeModel tree = read_tree(policy);
  const int layer = policy.at("layer").integer(1, tree.num_layers());
  const auto layout = static_cast<ThetaLayout>(policy.at("layout").word(kLayoutWords));
  return Policy{std::move(tree), layer, layout};
}

}  // namespace

std::string to_json(const Policy& policy) {
  const TreeModel& tree = policy.tree;
  json out;
  out["format"] = kFormat;
  out["version"] = kVersion;
  out["frames"] = kFrameWords[static_cast<std::size_t>(tree.frame_kind())];
  out["input_dim"] = tree.input_dim();
  out["layer"] = policy.layer;
  out["layout"] = kLayoutWords[static_cast<std::size_t>(policy.layout)];
  for (int layer = 1; layer <= tree.num_layers(); ++layer) {
    const bool with_axes =
        tree.frame_kind() == FrameKind::kEigenvector && layer < tree.num_layers();
    json nodes = json::array();
    for (const TreeModel::Node& node : tree.nodes(layer)) {
      nodes.push_back(node_to_json(node, with_axes));
    }
    out["layers"].push_back(std::move(nodes));
  }
  return out.dump();
}

Result<Policy> policy_from_json(std::string_view text) {
  try {
    return read_policy(text);
  } catch (const Refusal& refusal) {
    return Error{refusal.what()};
  }
}

}  // namespace treeroll
