#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// "the {what} is not finite at {time_s} s".
Error not_finite(std::string_view what, double time_s);
/// The same of the first of its numbers that is not. Precondition: one is not.
Error not_finite(const CartPendulumState& state, double time_s);

/// The output steps of a duration: times are multiples of the step, not sums, so that they do not
/// drift; the last step is shortened to end at the duration.
class OutputSteps {
 public:
  /// Precondition: both finite, the duration not negative, the step positive.
  OutputSteps(double duration_s, double step_s);
  /// Number of steps: step k goes from time_s(k) to time_s(k + 1).
  std::int64_t size() const { return size_; }
  double time_s(std::int64_t k) const {
    return k == size_ ? duration_s_ : static_cast<double>(k) * step_s_;
  }
  double length_s(std::int64_t k) const { return time_s(k + 1) - time_s(k); }
  /// The start, middle and end of each step, ascending: 2 size() + 1 times. (The start of a step
  /// plus its length is its end, to the bit.)
  std::vector<double> starts_and_middles_s() const;

 private:
  double duration_s_;
  double step_s_;
  std::int64_t size_;
};

/// From the state and input at time_s to the state at time_s + step_s.
using StateStep = std::function<Result<CartPendulumState>(
    double time_s, double step_s, const CartPendulumState& state, double cart_acceleration)>;

/// The loop all plants share: visits the start and the state after each step, and checks that
/// states and inputs are finite.
Result<CartPendulumState> run_output_steps(const CartPendulumState& start, double duration_s,
                                           double step_s, const CartAcceleration& input,
                                           const StateVisitor& visit, const StateStep& advance);

}  // namespace treeroll::sim
