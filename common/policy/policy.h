#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"

namespace treeroll {

/// What learner and workers must agree on to turn a theta into a mixture: a tree, the layer that
/// is explored, and the layout of theta. The content of a policy definition.
struct Policy {
  TreeModel tree;
  int layer = 1;  ///< 1 .. tree.num_layers()
  ThetaLayout layout = ThetaLayout::kMeansCholesky;

  int theta_dim() const;
  /// theta of the tree as it stands at `layer`.
  Eigen::VectorXd theta() const;
  /// The tree with theta at `layer`.
  TreeModel tree_with(const Eigen::Ref<const Eigen::VectorXd>& theta) const;
  /// What a roll-out executes: the finest layer of tree_with(theta). Rewards are always taken
  /// there (section 3-2-4). Like tree_with: the precondition is that of with_theta; throws
  /// std::invalid_argument where theta is so extreme that rounding leaves no valid mixture.
  Gmm decode(const Eigen::Ref<const Eigen::VectorXd>& theta) const;
};

/// JSON with a format version, keys sorted, numbers in their shortest exact form: equal policies
/// give equal text, and reading it back gives the same bits. Text from outside is checked fully:
/// an Error names the place and the rule. The format:
///
///   {"format": "treeroll-policy", "version": 1, "frames": "eigenvector" | "cholesky",
///    "layout": one of kThetaLayoutNames, "input_dim": 1, "layer": 2,
///    "layers": [[{"parent": -1, "prior": .5, "mean": [d numbers],
///                 "covariance": [lower triangle, row by row],
///                 "axes": [d x d, row by row; eigenvector frames above the finest layer only]},
///                ...], ...]}
std::string to_json(const Policy& policy);
Result<Policy> policy_from_json(std::string_view text);

}  // namespace treeroll
