#pragma once

#include <functional>
#include <string_view>

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// "the {what} is not finite at {time_s} s".
Error not_finite(std::string_view what, double time_s);
/// The same of the first of its numbers that is not. Precondition: one is not.
Error not_finite(const CartPendulumState& state, double time_s);

/// From the state and input at time_s to the state at time_s + step_s.
using StateStep = std::function<Result<CartPendulumState>(
    double time_s, double step_s, const CartPendulumState& state, double cart_acceleration)>;

/// The loop all plants share: visits the start and the state after each step, checks that states
/// and inputs are finite, and shortens the last step to end at duration_s. Times are multiples of
/// step_s, not sums, so that they do not drift.
/// @param step_s  positive
Result<CartPendulumState> run_output_steps(const CartPendulumState& start, double duration_s,
                                           double step_s, const CartAcceleration& input,
                                           const StateVisitor& visit, const StateStep& advance);

}  // namespace treeroll::sim
