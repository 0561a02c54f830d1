#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace treeroll {

/// A recording as a function: linear between its inputs, its end values beyond them.
class RecordedCurve {
 public:
  /// Throws std::invalid_argument unless the inputs rise and all numbers are finite.
  /// @param inputs   at least 2
  /// @param outputs  dO x as many
  RecordedCurve(std::vector<double> inputs, Eigen::MatrixXd outputs);

  const std::vector<double>& inputs() const { return inputs_; }
  const Eigen::MatrixXd& outputs() const { return outputs_; }
  /// @param into  dO numbers
  void at(double input, std::span<double> into) const;

 private:
  std::vector<double> inputs_;
  Eigen::MatrixXd outputs_;
};

using RecordedCurvePtr = std::shared_ptr<const RecordedCurve>;

}  // namespace treeroll
