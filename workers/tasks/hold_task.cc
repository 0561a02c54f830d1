#include "workers/tasks/hold_task.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/swing_up_task.h"
#include "workers/tasks/time_mean.h"
#include "workers/tasks/trace.h"

namespace treeroll {
namespace {

constexpr int kStateDim = 6;

sim::CartPendulumState about(double target_rad, sim::CartPendulumState state) {
  state.phi1 -= target_rad;
  state.phi2 -= target_rad;
  return state;
}

}  // namespace

HoldTask::HoldTask(SettingsReader& settings)
    : target_rad_(settings.choice("target", {"hanging", "upright"}, "hanging",
                                  {.meaning = "Where the pendulum is to be held"}) == "upright"
                      ? 0
                      : -std::numbers::pi),
      start_{
          .phi1 = target_rad_ +
                  settings.number("start_phi1", kAngle, .3,
                                  {.meaning = "First angle at the start, from the target, at rest",
                                   .unit = "rad"}),
          .phi2 = target_rad_ +
                  settings.number(
                      "start_phi2", kAngle, -.2,
                      {.meaning = "Second angle at the start, from the target", .unit = "rad"})},
      duration_s_(settings.number("duration_s", kSimulatedTime, 5,
                                  {.meaning = "Simulated time", .unit = "s"})),
      alpha_(
          settings.number("alpha", kPositive, 10, {.meaning = "Of the reward exp(-alpha mean c)"})),
      acceleration_max_mps2_(settings.number(
          "acceleration_max_mps2", kAccelerationMax, 20,
          {.meaning = "What the cart can do: outputs are cut to it", .unit = "m/s^2"})),
      time_limit_s_(read_time_limit_s(settings)),
      plant_(sim::read_plant_settings(settings), read_plant_variation(settings)) {
  if (!settings.has("feedback")) return;
  if (settings.choice("feedback", {"none", "lqr"}, {},
                      {.meaning = "The policy's acceleration comes on top of that of a linear "
                                  "quadratic regulator about the target, or acts alone; where the "
                                  "key stands, the trace tells whether the plant is held"}) ==
      "lqr") {
    regulator_.emplace(settings, plant_.settings(), target_rad_);
  }
  SettingsReader holds = settings.table("holds");
  holding_ = read_holding_rule(holds, duration_s_);
  holds.finish();
}

TaskDescription HoldTask::description() const {
  return {.input_dim = kStateDim,
          .output_dim = 1,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = plant_.deterministic(),
          .signals = signals()};
}

/// Where something else holds as well, its acceleration and the policy's are two.
SignalNames HoldTask::signals() const {
  return {{"phi1_rad", "phi2_rad", "y_m", "phi1_rate_radps", "phi2_rate_radps", "y_rate_mps"},
          {holding_ ? "policy_mps2" : "cart_acceleration_mps2"}};
}

Outcome HoldTask::evaluate(Controller& controller, std::uint64_t seed) {
  return roll_out(controller, seed, nullptr);
}

Outcome HoldTask::evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) {
  const auto [inputs, outputs] = signals();
  std::vector<std::string> columns = {"time_s"};
  columns.insert(columns.end(), inputs.begin(), inputs.end());
  columns.insert(columns.end(), {"cart_acceleration_mps2", "cost"});
  if (holding_) columns.insert(columns.end(), {"policy_mps2", "holds"});
  trace.set_columns(columns);
  trace.set_policy_columns(inputs, outputs);
  return roll_out(controller, seed, &trace);
}

Outcome HoldTask::roll_out(Controller& controller, std::uint64_t seed, Trace* trace) {
  CHECK(controller.input_dim() == kStateDim && controller.output_dim() == 1,
        "a controller from the state to the acceleration of the cart");
  const auto policy_mps2 = [&](const sim::CartPendulumState& state) {
    const sim::CartPendulumState x = about(target_rad_, state);
    const std::array input = {x.phi1, x.phi2, x.y, x.phi1_rate, x.phi2_rate, x.y_rate};
    double acceleration_mps2 = 0;
    controller.act(input, {&acceleration_mps2, 1});
    return acceleration_mps2;
  };
  double given_mps2 = 0;  // by the policy, last: a trace must not ask it once more
  const auto feedback = [&](double, const sim::CartPendulumState& state) {
    // A state on its way to diverging may not be finite between two steps; no controller takes it.
    if (!sim::is_finite(state)) return 0.;
    given_mps2 = policy_mps2(state);
    double wanted_mps2 = given_mps2;
    if (regulator_) wanted_mps2 += regulator_->acceleration(state);
    return std::clamp(wanted_mps2, -acceleration_max_mps2_, acceleration_max_mps2_);
  };
  return plant_.evaluate(
      seed, start_, [&](sim::CartPendulumPlant& plant, const sim::CartPendulumState& start) {
        controller.start();
        TimeMean cost;
        TimeMean angles;
        TimeMean cart;
        TimeMean rates;
        Holding holding(holding_.value_or(HoldingRule{}));
        const auto end = plant.simulate(
            start, duration_s_, feedback,
            [&](double time_s, const sim::CartPendulumState& state, double cart_acceleration_mps2) {
              const sim::CartPendulumState x = about(target_rad_, state);
              const double now = swing_up_cost(x);
              cost.see(time_s, now);
              holding.see(time_s, x);
              if (trace == nullptr) return true;
              const SwingUpCost terms = swing_up_terms(x);
              angles.see(time_s, terms.angles);
              cart.see(time_s, terms.cart);
              rates.see(time_s, terms.rates);
              std::vector<double> row = {time_s,      x.phi1,      x.phi2,   x.y,
                                         x.phi1_rate, x.phi2_rate, x.y_rate, cart_acceleration_mps2,
                                         now};
              if (holding_) {
                row.insert(row.end(), {given_mps2, holding.holds() ? 1. : 0.});
              }
              trace->add_row(row);
              return true;
            });
        if (trace != nullptr) {
          trace->set_term("mean_cost", cost.mean());
          trace->set_term("mean_cost_angles", angles.mean());
          trace->set_term("mean_cost_cart", cart.mean());
          trace->set_term("mean_cost_rates", rates.mean());
        }
        if (!end) return Outcome::failed(RolloutStatus::kDiverged, end.error().message);
        return Outcome::ok(elementary::exp(-alpha_ * cost.mean()));
      });
}

}  // namespace treeroll
