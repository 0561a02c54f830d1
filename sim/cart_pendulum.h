#pragma once

#include <functional>

#include "common/base/result.h"

namespace treeroll::sim {

/// Double pendulum on a cart, thesis appendix B and table of [7]. Lengths in m, masses in kg,
/// inertias about the centres of gravity in kg m^2, friction in N m s, gravity in m/s^2.
struct DoublePendulum {
  double l1 = .323, l2 = .480;   ///< link lengths
  double a1 = .2145, a2 = .223;  ///< joint to centre of gravity
  double m1 = .853, m2 = .510;
  double j1 = .0126, j2 = .0185;
  double d1 = .005, d2 = .005;  ///< viscous friction of the joints
  double gravity = 9.81;
  bool operator==(const DoublePendulum&) const = default;
};

/// Angles from upright, counter-clockwise, not wrapped, in rad; cart position in m; and rates.
struct CartPendulumState {
  double phi1 = 0, phi2 = 0, y = 0;
  double phi1_rate = 0, phi2_rate = 0, y_rate = 0;
  bool operator==(const CartPendulumState&) const = default;
};

/// Whether all six numbers are.
bool is_finite(const CartPendulumState& state);

/// Acceleration of the cart in m/s^2, at a time in s and a state.
using CartAcceleration = std::function<double(double time_s, const CartPendulumState& state)>;

/// Sees the state at the start and after each output step with the input applied there; returns
/// false to end the simulation.
using StateVisitor =
    std::function<bool(double time_s, const CartPendulumState& state, double cart_acceleration)>;

/// A plant: a state and an input in, states over time out. Knows no policy and no reward.
///
///   sim::Rk4Plant plant(sim::DoublePendulum{}, 1e-3);
///   const auto go_on = [](double, const CartPendulumState&, double) { return true; };
///   const auto end = plant.simulate(start, 2.5, input, go_on);
///   if (!end) ...  // diverged
///
/// One thread at a time. A simulation does not depend on the ones before it: the same start and
/// input give the same bits.
class CartPendulumPlant {
 public:
  virtual ~CartPendulumPlant() = default;
  /// Simulates from `start` for duration_s (finite, not negative). The visitor sees every output
  /// step (the plant's own step, or output_step_s for an adaptive integrator); the last one is
  /// shorter where the duration is not a multiple of it. Input and visitor may throw.
  /// @return the final state (the one at which the visitor said stop), or an error if a state or
  ///         the input left the finite numbers or the integrator could not go on (a diverged
  ///         roll-out). The visitor never sees a state that is not finite.
  virtual Result<CartPendulumState> simulate(const CartPendulumState& start, double duration_s,
                                             const CartAcceleration& input,
                                             const StateVisitor& visit) = 0;
};

}  // namespace treeroll::sim
