#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/policy/linear/basis.h"
#include "common/policy/linear/recorded_curve.h"

namespace treeroll {

/// Dynamic movement primitives (Ijspeert and others 2002, 2013) over [low, high], tau its length:
///
///   tau z' = al (be (g - x) - z) + f(s)    tau x' = z    tau s' = -a s    x = x_0, z = 0, s = 1
///   f(s) = s sum psi_i(s) w_i / sum psi_i(s)    psi_i(s) = exp(-h_i (s - c_i)^2)
///
/// with al 25, be al / 4, a = log(100). The output is x. It is linear in the weights w, the goal g
/// and the start x_0, so these equations are integrated once for each, as a table: a policy adds up
/// unit responses.
///
/// Functions: that of each weight, then that of the goal. A weight counts by the output that it
/// makes: its response is scaled to an rms of 1 over the range, for those of late weights are a
/// hundredth of the first's, and weights of an output of 6 some 10^4.
class MovementPrimitive final : public Basis {
 public:
  static constexpr int kSteps = 2048;  ///< of the table

  /// Precondition: num_weights >= 2, low < high.
  MovementPrimitive(int num_weights, double low, double high);

  int size() const override { return static_cast<int>(responses_.rows()); }
  double low() const override { return low_; }
  double high() const override { return high_; }
  int num_at_once() const override { return size(); }
  int values(double input, std::span<double> values) const override;

  /// What the primitives do from x_0 with all weights and the goal 0.
  /// @param starts  x_0 of each output
  RecordedCurvePtr from(const std::vector<double>& starts) const;

 private:
  double low_;
  double high_;
  Eigen::MatrixXd responses_;  // size() x (kSteps + 1)
};

}  // namespace treeroll
