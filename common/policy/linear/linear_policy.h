#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/policy/linear/linear_form.h"
#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

/// A function of one input, linear in theta: for each output functions of the form's layer, each
/// times a coefficient, on top of the curve below if the form has one.
///
/// What is executed is the finest layer. A coarser one that is explored moves it as a whole, and
/// leaves what only the finer can express where it is.
///
/// theta: coefficients of the layer, output by output.
class LinearPolicy final : public Policy {
 public:
  static constexpr int kSizeMax = 256;  ///< coefficients of an output, finest layer
  static constexpr int kOutputsMax = 32;

  /// @param coefficients  dO x form->finest().size(), finite
  /// Throws std::invalid_argument where a coefficient is past 1e50.
  LinearPolicy(LinearFormPtr form, Eigen::MatrixXd coefficients, int layer);

  const LinearForm& form() const { return *form_; }
  const Eigen::MatrixXd& coefficients() const { return coefficients_; }

  std::string_view kind() const override { return form_->kind(); }
  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  int num_layers() const override { return form_->num_layers(); }
  int layer() const override { return layer_; }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override { return output_dim() * form_->layer(layer_).size(); }
  Eigen::VectorXd theta() const override;
  PolicyPtr with(const Eigen::VectorXd& theta) const override;
  std::unique_ptr<Controller> controller() const override;
  NextLayer next_layer(const Eigen::VectorXd& theta) const override;
  /// One number for each output.
  int noise_variance_dim() const override { return output_dim(); }
  Eigen::VectorXd noise_variance(std::span<const double> given) const override;
  Eigen::VectorXd steps_of_equal_effect() const override;
  PolicyEffect effect() const override;
  PolicySketch sketch() const override;
  nlohmann::json content() const override;

 private:
  /// Coefficients of the finest layer with theta at layer().
  Eigen::MatrixXd coefficients_with(const Eigen::VectorXd& theta) const;
  std::unique_ptr<Controller> controller_of(int layer) const;
  /// The functions of layer(), at inputs spread over the range.
  Eigen::MatrixXd functions(std::vector<double>& inputs) const;

  LinearFormPtr form_;
  Eigen::MatrixXd coefficients_;  // dO x n, of the finest layer
  int layer_;
};

/// The kinds in JSON: what the form says (spline_form.h, basis_form.h), and
///
///   {"layer": 1, "coefficients": [[7 numbers]]}
///
/// coefficients of the finest layer, a row an output. Throw PolicyTextError.
PolicyPtr spline_from_content(const PolicyText& content);
PolicyPtr correction_from_content(const PolicyText& content);
PolicyPtr rbf_from_content(const PolicyText& content);
PolicyPtr dmp_from_content(const PolicyText& content);

}  // namespace treeroll
