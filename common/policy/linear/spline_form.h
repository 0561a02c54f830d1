#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "common/policy/linear/bspline.h"
#include "common/policy/linear/linear_form.h"

namespace treeroll {

/// The layers of splines, coarse to fine: each has twice the spans of the one before, so that its
/// curves are among those of the next. Computed once for all policies of a run.
class SplineLadder {
 public:
  static constexpr int kLayersMax = 8;

  /// Precondition: the finest layer has at most LinearPolicy::kSizeMax coefficients, and
  /// 1 <= num_layers <= kLayersMax.
  SplineLadder(BSpline coarsest, int num_layers);

  int num_layers() const { return static_cast<int>(layers_.size()); }
  const BSpline& layer(int layer) const { return layers_[static_cast<std::size_t>(layer - 1)]; }
  const BSpline& finest() const { return layers_.back(); }
  /// As those of LinearForm.
  const Eigen::MatrixXd& lift(int layer) const {
    return lifts_[static_cast<std::size_t>(layer - 1)];
  }
  const Eigen::MatrixXd& drop(int layer) const {
    return drops_[static_cast<std::size_t>(layer - 1)];
  }

 private:
  std::vector<BSpline> layers_;
  std::vector<Eigen::MatrixXd> lifts_;
  std::vector<Eigen::MatrixXd> drops_;
};

/// B-splines, on top of a recorded curve if there is one. Without it the kind is "spline" (evolving
/// policy parameterization, Kormushev and others 2011, as knot insertion), with it "correction": of
/// a demonstration, which acts as it was recorded while theta is 0.
///
/// In JSON: {"degree": 3, "range": [0, 2.2], "sizes": [5, 7]}, sizes of the layers, coarse to fine;
/// of a correction "inputs": [...] and "outputs": [[...], ...] of its recording as well.
class SplineForm final : public LinearForm {
 public:
  /// @param recorded  may be null
  SplineForm(std::shared_ptr<const SplineLadder> ladder, RecordedCurvePtr recorded)
      : ladder_(std::move(ladder)), recorded_(std::move(recorded)) {}

  std::string_view kind() const override { return recorded_ ? "correction" : "spline"; }
  int num_layers() const override { return ladder_->num_layers(); }
  const BSpline& layer(int layer) const override { return ladder_->layer(layer); }
  const Eigen::MatrixXd& lift(int layer) const override { return ladder_->lift(layer); }
  const Eigen::MatrixXd& drop(int layer) const override { return ladder_->drop(layer); }
  const RecordedCurve* below() const override { return recorded_.get(); }
  nlohmann::json content() const override;

 private:
  std::shared_ptr<const SplineLadder> ladder_;
  RecordedCurvePtr recorded_;
};

}  // namespace treeroll
