#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/policy/policy_registry.h"

namespace treeroll {

/// A small kind of policy of the tests, as a kind may look: polynomials in time,
///   u_o(t) = sum over j of c_oj x^j,  x = (t - low) / (high - low), cut to [0, 1].
/// A ladder of degrees makes the layers: layer l explores the coefficients up to degrees[l - 1].
class PolynomialPolicy final : public Policy {
 public:
  struct Range {
    double low = 0;
    double high = 1;
  };
  /// @param degrees       rising, one for each layer
  /// @param coefficients  dO x (degrees.back() + 1)
  PolynomialPolicy(std::vector<int> degrees, Range range, Eigen::MatrixXd coefficients, int layer);

  std::string_view kind() const override { return "polynomial"; }
  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  int num_layers() const override { return static_cast<int>(degrees_.size()); }
  int layer() const override { return layer_; }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override { return output_dim() * num_explored(); }
  /// c_10, c_11, ..., c_20, ...: output by output.
  Eigen::VectorXd theta() const override;
  PolicyPtr with(const Eigen::VectorXd& theta) const override;
  std::unique_ptr<Controller> controller() const override;
  NextLayer next_layer(const Eigen::VectorXd& theta) const override;
  /// One number for each output.
  int noise_variance_dim() const override { return output_dim(); }
  Eigen::VectorXd noise_variance(std::span<const double> given) const override;
  /// 1 / rms of x^j over [0, 1].
  Eigen::VectorXd steps_of_equal_effect() const override;
  PolicyEffect effect() const override;
  PolicySketch sketch() const override;
  nlohmann::json content() const override;

 private:
  int num_explored() const { return degrees_[static_cast<std::size_t>(layer_ - 1)] + 1; }
  Eigen::MatrixXd coefficients_with(const Eigen::VectorXd& theta) const;

  std::vector<int> degrees_;
  Range range_;
  Eigen::MatrixXd coefficients_;
  int layer_;
};

/// {"coefficients": a row an output, "degrees": [1, 3], "layer": 1, "range": [0, 2]}.
PolicyPtr polynomial_from_content(const PolicyText& content);

/// The [policy] table of a study:
///   kind = "polynomial"
///   outputs = 1
///   degrees = [1, 3]    # of the layers
///   range = [0, 1]      # of time
/// It starts at 0.
StartPolicy read_polynomial_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
