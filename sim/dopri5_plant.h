#pragma once

#include <cstdint>

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// Accuracy of the adaptive integrator.
struct Dopri5Settings {
  double output_step_s = 1e-3;  ///< what the visitor sees; does not limit the integrator's steps
  double relative_tolerance = 1e-9;
  double absolute_tolerance = 1e-12;
  std::int64_t steps_max = 1'000'000;  ///< accepted steps of one simulation; more is an error
  bool operator==(const Dopri5Settings&) const = default;
};

/// The equations of motion, integrated by Boost.Odeint's Dormand-Prince 5(4) with step control and
/// dense output: Matlab's ode45, which the thesis used. The plant is chaotic: at ode45's default
/// tolerances (1e-3, 1e-6) the state at 2.2 s is wrong by radians.
class Dopri5Plant : public CartPendulumPlant {
 public:
  Dopri5Plant(const DoublePendulum& pendulum, const Dopri5Settings& settings);

  Result<CartPendulumState> simulate(const CartPendulumState& start, double duration_s,
                                     const CartAcceleration& input,
                                     const StateVisitor& visit) override;

 private:
  DoublePendulum pendulum_;
  Dopri5Settings settings_;
};

}  // namespace treeroll::sim
