#include "workers/tasks/lqr_tracking.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "sim/equations_of_motion.h"

namespace treeroll {
namespace {

using sim::StateVector;

constexpr NumberRule kStateWeight{.min = 0, .max = 1e6};
constexpr NumberRule kInputWeight{.min = 1e-6, .max = 1e6};
/// Of the gains along a motion.
constexpr double kStepS = 1e-3;
/// The regulator's fastest motion times the plant's step: half of it is followed in one.
constexpr double kFastestPerStep = .5;
/// And whatever the step, so that the gains' own steps follow it well.
constexpr double kFastestPerS = 100;

QuadraticCost read_cost(SettingsReader& table) {
  const std::vector<double> weights = table.numbers(
      "state_weights", kStateWeight, 6, 6, {{100, 100, 10, 1, 1, 1}},
      {.meaning = "Of the regulator: how dear deviations of phi1, phi2, y and their rates are"});
  const double input_weight =
      table.number("input_weight", kInputWeight, .1,
                   {.meaning = "Of the regulator: how dear the cart's acceleration is"});
  return {StateVector(weights.data()).asDiagonal(), input_weight};
}

}  // namespace

RestRegulator::RestRegulator(SettingsReader& settings, const sim::PlantSettings& plant,
                             double rest_rad)
    : rest_(rest_rad, rest_rad, 0, 0, 0, 0) {
  SettingsReader table = settings.table("lqr");
  cost_ = read_cost(table);
  table.finish();
  const sim::LinearDynamics dynamics = linear_dynamics(plant.parameters, sim::to_state(rest_), 0);
  const auto riccati = stationary_riccati(dynamics, cost_);
  if (!riccati) {
    table.refuse("state_weights",
                 "must be such that a stable regulator comes of them: where the cart's place, the "
                 "third, costs nothing, it drifts away");
  }
  riccati_ = *riccati;
  gains_ = regulator_gains(dynamics.by_input, riccati_, cost_);
  const double fastest_per_s = regulator_speed(dynamics, gains_).fastest;
  const bool has_steps = plant.kind != sim::PlantKind::kDopri5;
  const double followed_per_s =
      has_steps ? std::min(kFastestPerS, kFastestPerStep / plant.step_s) : kFastestPerS;
  if (fastest_per_s > followed_per_s) {
    table.refuse("input_weight",
                 fmt::format("must be larger beside state_weights: the regulator would act at "
                             "{:.3g} per second, and a simulation follows {:g}",
                             fastest_per_s, followed_per_s));
  }
}

double RestRegulator::acceleration(const sim::CartPendulumState& state) const {
  return -gains_.dot(sim::to_vector(state) - rest_);
}

void NominalMotion::add(double time_s, const sim::DoublePendulum& pendulum,
                        const sim::CartPendulumState& state, double cart_acceleration) {
  CHECK(steps_.empty() || time_s > steps_.back().time_s, "a motion goes on in time");
  steps_.push_back(
      {.time_s = time_s,
       .state = sim::to_vector(state),
       .rate = sim::to_vector(sim::state_derivative(pendulum, state, cart_acceleration))});
}

StateVector NominalMotion::state(double time_s) const {
  const auto after = std::upper_bound(steps_.begin(), steps_.end(), time_s,
                                      [](double t, const Step& step) { return t < step.time_s; });
  CHECK(after != steps_.begin(), "a time within the motion");
  const Step& from = *(after - 1);
  if (after == steps_.end() || time_s == from.time_s) return from.state;
  const double h = after->time_s - from.time_s;
  const double s = (time_s - from.time_s) / h;
  return (1 + 2 * s) * (1 - s) * (1 - s) * from.state + s * (1 - s) * (1 - s) * h * from.rate +
         s * s * (3 - 2 * s) * after->state - s * s * (1 - s) * h * after->rate;
}

MotionRegulator::MotionRegulator(const sim::DoublePendulum& pendulum, const NominalMotion& motion,
                                 const std::function<double(double)>& acceleration, double end_s,
                                 const RestRegulator& end)
    : motion_(motion), end_s_(end_s) {
  const auto dynamics = [&](double time_s) {
    return linear_dynamics(pendulum, sim::to_state(motion.state(time_s)), acceleration(time_s));
  };
  const int num_steps = std::max(1, static_cast<int>(std::ceil(end_s / kStepS - 1e-9)));
  gains_ = gains_backwards(dynamics, end_s, num_steps, end.riccati(), end.cost());
}

bool MotionRegulator::is_finite() const {
  return std::all_of(gains_.begin(), gains_.end(),
                     [](const StateVector& gains) { return gains.allFinite(); });
}

double MotionRegulator::correction(double time_s, const sim::CartPendulumState& state) const {
  const auto last = static_cast<double>(gains_.size() - 1);
  const double place = std::clamp(time_s / end_s_ * last, 0., last);
  const auto before = std::min(static_cast<std::size_t>(place), gains_.size() - 2);
  const double share = place - static_cast<double>(before);
  const StateVector gains = (1 - share) * gains_[before] + share * gains_[before + 1];
  return -gains.dot(sim::to_vector(state) - motion_.state(time_s));
}

}  // namespace treeroll
