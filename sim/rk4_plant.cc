#include "sim/rk4_plant.h"

#include "sim/equations_of_motion.h"
#include "sim/output_steps.h"

namespace treeroll::sim {
namespace {

/// state + factor * derivative, element by element.
CartPendulumState moved(const CartPendulumState& state, double factor,
                        const CartPendulumState& derivative) {
  return {.phi1 = state.phi1 + factor * derivative.phi1,
          .phi2 = state.phi2 + factor * derivative.phi2,
          .y = state.y + factor * derivative.y,
          .phi1_rate = state.phi1_rate + factor * derivative.phi1_rate,
          .phi2_rate = state.phi2_rate + factor * derivative.phi2_rate,
          .y_rate = state.y_rate + factor * derivative.y_rate};
}

}  // namespace

Rk4Plant::Rk4Plant(const DoublePendulum& pendulum, double step_s)
    : pendulum_(pendulum), step_s_(step_s) {}

Result<CartPendulumState> Rk4Plant::simulate(const CartPendulumState& start, double duration_s,
                                             const CartAcceleration& input,
                                             const StateVisitor& visit) {
  const auto derivative = [&](double time_s, const CartPendulumState& state) {
    return state_derivative(pendulum_, state, input(time_s, state));
  };
  const auto advance = [&](double t, double h, const CartPendulumState& x,
                           double cart_acceleration) -> Result<CartPendulumState> {
    const CartPendulumState k1 = state_derivative(pendulum_, x, cart_acceleration);
    const CartPendulumState k2 = derivative(t + h / 2, moved(x, h / 2, k1));
    const CartPendulumState k3 = derivative(t + h / 2, moved(x, h / 2, k2));
    const CartPendulumState k4 = derivative(t + h, moved(x, h, k3));
    return moved(moved(moved(moved(x, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
  };
  return run_output_steps(start, duration_s, step_s_, input, visit, advance);
}

}  // namespace treeroll::sim
