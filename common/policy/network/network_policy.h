#pragma once

#include <Eigen/Core>
#include <memory>

#include "common/policy/network/network.h"
#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

/// Kind "network", of any number of inputs: a state, say. One layer.
///
/// theta: Network::numbers().
class NetworkPolicy final : public Policy {
 public:
  static constexpr int kHiddenMax = 64;
  static constexpr int kSignalsMax = 31;  ///< inputs, and outputs

  /// Throws std::invalid_argument where a number is past 1e50.
  explicit NetworkPolicy(Network network);

  const Network& network() const { return network_; }

  std::string_view kind() const override { return "network"; }
  int input_dim() const override { return network_.num_inputs(); }
  int output_dim() const override { return network_.num_outputs(); }
  int num_layers() const override { return 1; }
  int layer() const override { return 1; }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override {
    return static_cast<int>(network_.outer.size() + network_.inner.size());
  }
  Eigen::VectorXd theta() const override { return network_.numbers(); }
  PolicyPtr with(const Eigen::VectorXd& theta) const override;
  std::unique_ptr<Controller> controller() const override;
  NextLayer next_layer(const Eigen::VectorXd& theta) const override;
  /// One number for each output, of what is added up to it, then one for what goes into the hidden
  /// units.
  int noise_variance_dim() const override { return output_dim() + 1; }
  Eigen::VectorXd noise_variance(std::span<const double> given) const override;
  Eigen::VectorXd steps_of_equal_effect() const override;
  /// Over the ranges of the inputs. What goes into a hidden unit turns it over within 1: a step of
  /// it counts as one of the output at least, though nothing may move where a is 0.
  PolicyEffect effect() const override;
  PolicySketch sketch() const override;
  nlohmann::json content() const override;

 private:
  Network network_;
};

/// The kind in JSON:
///
///   {"ranges": [[0, 2.2]], "outer": [[a ... a, c]], "inner": [[w, v], ...]}
///
/// a row of outer for each output, of inner for each hidden unit. Throws PolicyTextError.
PolicyPtr network_from_content(const PolicyText& content);

}  // namespace treeroll
