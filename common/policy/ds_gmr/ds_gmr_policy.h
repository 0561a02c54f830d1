#pragma once

#include <Eigen/Core>
#include <memory>

#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

/// Kind "ds_gmr" (Calinon and others 2012): a movement that a spring and a damper pull along an
/// attractor, which is the regression of Gaussian mixtures over time.
///
/// theta, layers and noise are those of the attractor's policy.
class DsGmrPolicy final : public Policy {
 public:
  struct Pull {
    double low = 0;  ///< where it begins, at rest on the attractor
    double high = 1;
    double stiffness = 1;  ///< kp, 1/s^2; damping is critical
  };
  /// Whether the root of kp times the duration is within bounds: softer springs do not follow,
  /// stiffer ones have no effect.
  static bool is_pull(const Pull& pull);
  static constexpr const char* kPullRule = "its root times the duration must be 1 to 1e5";

  /// Preconditions: one input; is_pull().
  DsGmrPolicy(PolicyPtr attractor, const Pull& pull);

  const PolicyPtr& attractor() const { return attractor_; }
  const Pull& pull() const { return pull_; }

  std::string_view kind() const override { return "ds_gmr"; }
  int input_dim() const override { return 1; }
  int output_dim() const override { return attractor_->output_dim(); }
  int num_layers() const override { return attractor_->num_layers(); }
  int layer() const override { return attractor_->layer(); }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override { return attractor_->theta_dim(); }
  Eigen::VectorXd theta() const override { return attractor_->theta(); }
  PolicyPtr with(const Eigen::VectorXd& theta) const override;
  /// The movement as a table over the range, straight between its places. Before and after the
  /// range it keeps its end values.
  std::unique_ptr<Controller> controller() const override;
  NextLayer next_layer(const Eigen::VectorXd& theta) const override;
  int noise_variance_dim() const override { return attractor_->noise_variance_dim(); }
  Eigen::VectorXd noise_variance(std::span<const double> given) const override {
    return attractor_->noise_variance(given);
  }
  Eigen::VectorXd steps_of_equal_effect() const override {
    return attractor_->steps_of_equal_effect();
  }
  /// Of the movement, by differences; what counts at least is the attractor's.
  PolicyEffect effect() const override;
  /// The attractor's Gaussians, and the movement of each layer.
  PolicySketch sketch() const override;
  nlohmann::json content() const override;

 private:
  PolicyPtr attractor_;
  Pull pull_;
};

/// The kind in JSON:
///
///   {"range": [0, 2.2], "stiffness": 1600, "attractor": {what a tree's text holds}}
///
/// Throws PolicyTextError.
PolicyPtr ds_gmr_from_content(const PolicyText& content);

}  // namespace treeroll
