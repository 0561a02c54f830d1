#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "sim/double_pendulum.h"

namespace treeroll::sim {

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

/// A roll-out whose input depends on time alone.
struct OpenLoop {
  CartPendulumState start;
  std::span<const double> accelerations;  ///< of the cart, in m/s^2, at input_times()
};

/// As a StateVisitor, for one of several roll-outs, by its place among them.
using OpenLoopVisitor = std::function<void(
    std::size_t rollout, double time_s, const CartPendulumState& state, double cart_acceleration)>;

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

  /// Where simulate() asks for its input, ascending, if that does not depend on the state: with a
  /// fixed step. Empty where step control decides.
  virtual std::vector<double> input_times(double duration_s) const;
  /// simulate() of several roll-outs with inputs given beforehand, to the same bits: whatever the
  /// number of roll-outs, and whoever is beside one. Precondition: input_times() is not empty.
  virtual std::vector<Result<CartPendulumState>> simulate_open_loop(
      std::span<const OpenLoop> rollouts, double duration_s, const OpenLoopVisitor& visit);
  /// Whether that is more than one after the other.
  virtual bool side_by_side() const { return false; }
};

}  // namespace treeroll::sim
