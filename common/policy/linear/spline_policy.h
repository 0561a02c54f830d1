#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/policy/linear/bspline.h"
#include "common/policy/linear/recorded_curve.h"
#include "common/policy/policy.h"
#include "common/policy/policy_text.h"

namespace treeroll {

/// The layers of a spline policy, coarse to fine: each has twice the spans of the one before, so
/// that its curves are among those of the next. Computed once for all policies of a run.
class SplineLadder {
 public:
  static constexpr int kLayersMax = 8;
  static constexpr int kSizeMax = 256;  ///< coefficients of an output, finest layer

  /// Precondition: the finest layer has at most kSizeMax, and 1 <= num_layers <= kLayersMax.
  SplineLadder(BSpline coarsest, int num_layers);

  int num_layers() const { return static_cast<int>(layers_.size()); }
  const BSpline& layer(int layer) const { return layers_[static_cast<std::size_t>(layer - 1)]; }
  const BSpline& finest() const { return layers_.back(); }
  /// Coefficients of the finest layer from those of a layer: the same curve.
  const Eigen::MatrixXd& lift(int layer) const {
    return lifts_[static_cast<std::size_t>(layer - 1)];
  }
  /// The other way: the coefficients of the layer whose lift is nearest.
  const Eigen::MatrixXd& drop(int layer) const {
    return drops_[static_cast<std::size_t>(layer - 1)];
  }

 private:
  std::vector<BSpline> layers_;
  std::vector<Eigen::MatrixXd> lifts_;
  std::vector<Eigen::MatrixXd> drops_;
};

/// A function of one input, linear in theta: B-splines for each output, on top of a recorded curve
/// if there is one. Without it the kind is "spline" (evolving policy parameterization, Kormushev
/// and others 2011, as knot insertion), with it "correction": of a demonstration, which acts as it
/// was recorded while theta is 0.
///
/// What is executed is the finest layer. A coarser one that is explored moves it as a whole, and
/// leaves what only the finer can express where it is.
///
/// theta: coefficients of the layer, output by output.
class SplinePolicy final : public Policy {
 public:
  /// @param coefficients  dO x ladder->finest().size(), finite
  /// @param recorded      may be null
  /// Throws std::invalid_argument where a coefficient is past 1e50.
  SplinePolicy(std::shared_ptr<const SplineLadder> ladder, RecordedCurvePtr recorded,
               Eigen::MatrixXd coefficients, int layer);

  const SplineLadder& ladder() const { return *ladder_; }
  const Eigen::MatrixXd& coefficients() const { return coefficients_; }

  std::string_view kind() const override { return recorded_ ? "correction" : "spline"; }
  int input_dim() const override { return 1; }
  int output_dim() const override { return static_cast<int>(coefficients_.rows()); }
  int num_layers() const override { return ladder_->num_layers(); }
  int layer() const override { return layer_; }
  PolicyPtr at_layer(int layer) const override;
  int theta_dim() const override { return output_dim() * ladder_->layer(layer_).size(); }
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

  std::shared_ptr<const SplineLadder> ladder_;
  RecordedCurvePtr recorded_;
  Eigen::MatrixXd coefficients_;  // dO x n, of the finest layer
  int layer_;
};

/// The content of the two kinds in JSON:
///
///   {"degree": 3, "range": [0, 2.2], "sizes": [5, 7], "layer": 1, "coefficients": [[7 numbers]]}
///
/// sizes of the layers, coarse to fine; coefficients of the finest, a row an output. A correction
/// has "inputs": [...] and "outputs": [[...]] of its recording as well.
/// Throw PolicyTextError.
PolicyPtr spline_from_content(const PolicyText& content);
PolicyPtr correction_from_content(const PolicyText& content);

}  // namespace treeroll
