#include "sim/dopri5_plant.h"

#include <fmt/format.h>

#include <array>

// dense_output_runge_kutta.hpp of Boost 1.74 does not include these two, which it needs.
#include <boost/numeric/odeint/util/bind.hpp>
#include <boost/numeric/odeint/util/unwrap_reference.hpp>

#include <boost/numeric/odeint/stepper/dense_output_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

#include "sim/equations_of_motion.h"
#include "sim/output_steps.h"

namespace treeroll::sim {
namespace {

namespace odeint = boost::numeric::odeint;
using StateArray = std::array<double, 6>;

StateArray to_array(const CartPendulumState& state) {
  return {state.phi1, state.phi2, state.y, state.phi1_rate, state.phi2_rate, state.y_rate};
}

CartPendulumState from_array(const StateArray& x) {
  return {
      .phi1 = x[0], .phi2 = x[1], .y = x[2], .phi1_rate = x[3], .phi2_rate = x[4], .y_rate = x[5]};
}

}  // namespace

Dopri5Plant::Dopri5Plant(const DoublePendulum& pendulum, const Dopri5Settings& settings)
    : pendulum_(pendulum), settings_(settings) {}

Result<CartPendulumState> Dopri5Plant::simulate(const CartPendulumState& start, double duration_s,
                                                const CartAcceleration& input,
                                                const StateVisitor& visit) {
  const auto derivative = [&](const StateArray& x, StateArray& dxdt, double time_s) {
    const CartPendulumState state = from_array(x);
    dxdt = to_array(state_derivative(pendulum_, state, input(time_s, state)));
  };
  constexpr double kFirstStepS = 1e-3;  // a guess; the step control takes it from there
  auto stepper =
      odeint::make_dense_output(settings_.absolute_tolerance, settings_.relative_tolerance,
                                odeint::runge_kutta_dopri5<StateArray>());
  stepper.initialize(to_array(start), 0., kFirstStepS);
  std::int64_t num_steps = 0;
  const auto advance = [&](double t, double h, const CartPendulumState&,
                           double) -> Result<CartPendulumState> {
    while (stepper.current_time() < t + h) {
      if (++num_steps > settings_.steps_max) {
        return Error{fmt::format("more than {} integrator steps needed before {:.6g} s",
                                 settings_.steps_max, t + h)};
      }
      try {
        stepper.do_step(derivative);
      } catch (const odeint::step_adjustment_error&) {
        return Error{fmt::format("no step is small enough for the tolerance at {:.6g} s",
                                 stepper.current_time())};
      }
      // Otherwise a step that is NaN would never reach t + h.
      if (!is_finite(from_array(stepper.current_state()))) {
        return not_finite(from_array(stepper.current_state()), stepper.current_time());
      }
    }
    StateArray x{};
    stepper.calc_state(t + h, x);
    return from_array(x);
  };
  return run_output_steps(start, duration_s, settings_.output_step_s, input, visit, advance);
}

}  // namespace treeroll::sim
