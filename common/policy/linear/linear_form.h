#pragma once

#include <Eigen/Core>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "common/policy/linear/basis.h"
#include "common/policy/linear/recorded_curve.h"

namespace treeroll {

/// What the coefficients of a linear policy stand for: its layers of functions, coarse to fine, and
/// the curve that they are added to. One for each kind; immutable, shared by all policies of a run.
class LinearForm {
 public:
  virtual ~LinearForm() = default;

  virtual std::string_view kind() const = 0;  ///< its name in the registry
  virtual int num_layers() const { return 1; }
  virtual const Basis& layer(int layer) const = 0;
  const Basis& finest() const { return layer(num_layers()); }
  /// Coefficients of the finest layer from those of a coarser one: the same curve.
  /// Precondition: there is more than one layer.
  virtual const Eigen::MatrixXd& lift(int layer) const;
  /// The other way: the coefficients of the layer whose lift is nearest. As lift().
  virtual const Eigen::MatrixXd& drop(int layer) const;
  /// Null for none.
  virtual const RecordedCurve* below() const { return nullptr; }
  /// What a policy's text says of it, beside the layer and the coefficients: a JSON object.
  virtual nlohmann::json content() const = 0;
};

using LinearFormPtr = std::shared_ptr<const LinearForm>;

}  // namespace treeroll
