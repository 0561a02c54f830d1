#pragma once

#include <Eigen/Core>
#include <memory>

#include "common/policy/policy.h"
#include "common/policy/policy_text.h"
#include "common/policy/tree/theta_layout.h"
#include "common/policy/tree/tree_model.h"

namespace treeroll {

/// The policy of the thesis: a tree of Gaussian mixtures, the layer that is explored, and which of
/// its numbers are theta. Its output is the regression of the finest layer.
class TreePolicy final : public Policy {
 public:
  /// Precondition: layer is from 1 to tree.num_layers().
  TreePolicy(TreeModel tree, int layer, ThetaLayout layout);

  const TreeModel& tree() const { return tree_; }
  ThetaLayout layout() const { return layout_; }

  std::string_view kind() const override { return "tree"; }
  int input_dim() const override { return tree_.input_dim(); }
  int output_dim() const override { return tree_.dim() - tree_.input_dim(); }
  int num_layers() const override { return tree_.num_layers(); }
  int layer() const override { return layer_; }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override;
  Eigen::VectorXd theta() const override;
  PolicyPtr with(const Eigen::VectorXd& theta) const override;
  std::unique_ptr<Controller> controller() const override;
  NextLayer next_layer(const Eigen::VectorXd& theta) const override;
  /// One number for each element of a component's theta.
  int noise_variance_dim() const override;
  Eigen::VectorXd noise_variance(std::span<const double> given) const override;
  Eigen::VectorXd steps_of_equal_effect() const override;
  PolicyEffect effect() const override;
  PolicySketch sketch() const override;
  nlohmann::json content() const override;

  /// The tree with theta at `layer()`. Throws and requires what with() does.
  TreeModel tree_with(const Eigen::VectorXd& theta) const;
  /// What controller() of with(theta) regresses on: the finest layer of tree_with(theta).
  Gmm decode(const Eigen::VectorXd& theta) const;

 private:
  TreeModel tree_;
  int layer_;
  ThetaLayout layout_;
};

/// A tree's content in JSON:
///
///   {"frames": "eigenvector" | "cholesky", "layout": one of kThetaLayoutNames, "input_dim": 1,
///    "layer": 2,
///    "layers": [[{"parent": -1, "prior": .5, "mean": [d numbers],
///                 "covariance": [lower triangle, row by row],
///                 "axes": [d x d, row by row; eigenvector frames above the finest layer only]},
///                ...], ...]}
///
/// Throws PolicyTextError.
PolicyPtr tree_from_content(const PolicyText& content);

}  // namespace treeroll
