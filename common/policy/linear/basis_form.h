#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "common/policy/linear/linear_form.h"
#include "common/policy/linear/movement_primitive.h"
#include "common/policy/linear/radial_basis.h"

namespace treeroll {

/// Kind "rbf": normalised radial functions. In JSON: {"range": [0, 2.2]}.
class RadialForm final : public LinearForm {
 public:
  explicit RadialForm(RadialBasis basis) : basis_(std::move(basis)) {}

  std::string_view kind() const override { return "rbf"; }
  const Basis& layer(int /*layer*/) const override { return basis_; }
  nlohmann::json content() const override;

 private:
  RadialBasis basis_;
};

/// Kind "dmp": dynamic movement primitives, one for each output, which is their position. The
/// coefficients are weights, then the goal. In JSON: {"range": [0, 2.2], "starts": [5.1]}, where
/// each output begins.
class PrimitiveForm final : public LinearForm {
 public:
  /// Throws std::invalid_argument where the range is too short for its table.
  PrimitiveForm(MovementPrimitive basis, std::vector<double> starts)
      : basis_(std::move(basis)), starts_(std::move(starts)), below_(basis_.from(starts_)) {}

  std::string_view kind() const override { return "dmp"; }
  const Basis& layer(int /*layer*/) const override { return basis_; }
  const RecordedCurve* below() const override { return below_.get(); }
  nlohmann::json content() const override;

 private:
  MovementPrimitive basis_;
  std::vector<double> starts_;
  RecordedCurvePtr below_;
};

}  // namespace treeroll
