#include "workers/tasks/swing_up_and_hold_task.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "sim/output_steps.h"
#include "workers/tasks/cart_pendulum_pose.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/trace.h"

namespace treeroll {
namespace {

/// Where step control decides when it asks, the acceleration is straight between such times.
constexpr double kFeedForwardStepS = 5e-4;

std::vector<double> feed_forward_times(const sim::CartPendulumPlant& plant, double duration_s) {
  std::vector<double> times_s = plant.input_times(duration_s);
  if (times_s.empty()) {
    times_s = sim::OutputSteps(duration_s, kFeedForwardStepS).starts_and_middles_s();
  }
  return times_s;
}

}  // namespace

SwingUpAndHoldTask::SwingUpAndHoldTask(SettingsReader& settings)
    : SwingUpAndHoldTask(
          settings,
          settings.choice(
              "feedback", {"none", "lqr"}, {},
              {.meaning = "Where it stands the task is to swing up and hold: with \"lqr\" a "
                          "time-varying regulator keeps the plant along the nominal motion and "
                          "then upright, with \"none\" the policy's acceleration acts alone"}) ==
              "lqr") {}

SwingUpAndHoldTask::SwingUpAndHoldTask(SettingsReader& settings, bool has_feedback)
    : swing_up_(read_swing_up_settings(settings)),
      acceleration_max_mps2_(settings.number(
          "acceleration_max_mps2", kAccelerationMax, 20,
          {.meaning = "What the cart can do: all accelerations are cut to it", .unit = "m/s^2"})),
      links_(visible_links(swing_up_.plant, swing_up_.variation)),
      plant_(swing_up_.plant, swing_up_.variation) {
  if (has_feedback) regulator_.emplace(settings, swing_up_.plant, 0.);
  SettingsReader holds = settings.table("holds");
  holding_ = read_holding_rule(
      holds,
      holds.number(
          "until_s", kSimulatedTime, holding_.until_s,
          {.meaning =
               "Until so long after the nominal motion's least cost the plant must stay upright",
           .unit = "s"}));
  reward_share_ = holds.number("reward_share", {.min = 0, .max = 1}, reward_share_,
                               {.meaning = "Share of the reward that holding is worth"});
  holds.finish();
}

TaskDescription SwingUpAndHoldTask::description() const {
  return {.input_dim = 1,
          .output_dim = 1,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = swing_up_.time_limit_s,
          .deterministic = plant_.deterministic(),
          .signals = {{"time_s"}, {"feed_forward_mps2"}}};
}

Outcome SwingUpAndHoldTask::evaluate(Controller& controller, std::uint64_t seed) {
  return roll_out(controller, seed, nullptr);
}

Outcome SwingUpAndHoldTask::evaluate_traced(Controller& controller, std::uint64_t seed,
                                            Trace& trace) {
  trace.set_columns({"time_s", "phi1_rad", "phi2_rad", "y_m", "phi1_rate_radps", "phi2_rate_radps",
                     "y_rate_mps", "cart_acceleration_mps2", "cost", "goal_phi1_rad",
                     "goal_phi2_rad", "goal_y_m", "feed_forward_mps2", "holds"});
  const auto [inputs, outputs] = description().signals;
  trace.set_policy_columns(inputs, outputs);
  return roll_out(controller, seed, &trace);
}

Result<SwingUpAndHoldTask::Nominal> SwingUpAndHoldTask::nominal(const FeedForward& acceleration) {
  Nominal nominal{.motion = {}, .cost_min = std::numeric_limits<double>::infinity()};
  const auto end = plant_.plant().simulate(
      swing_up_.start, swing_up_.duration_s,
      [&](double time_s, const sim::CartPendulumState&) { return acceleration.at(time_s); },
      [&](double time_s, const sim::CartPendulumState& state, double cart_acceleration) {
        nominal.motion.add(time_s, swing_up_.plant.parameters, state, cart_acceleration);
        const double cost = swing_up_cost(state);
        if (cost < nominal.cost_min) nominal.cost_min = cost, nominal.cost_min_s = time_s;
        return true;
      });
  if (!end) return end.error();
  return nominal;
}

Outcome SwingUpAndHoldTask::roll_out(Controller& controller, std::uint64_t seed, Trace* trace) {
  CHECK(controller.input_dim() == 1 && controller.output_dim() == 1,
        "a controller from time to acceleration");
  const double last_s = swing_up_.duration_s + (regulator_ ? 0 : holding_.until_s);
  const FeedForward acceleration(controller, feed_forward_times(plant_.plant(), last_s),
                                 acceleration_max_mps2_);
  const Result<Nominal> nominal = this->nominal(acceleration);
  if (!nominal) return Outcome::failed(RolloutStatus::kDiverged, nominal.error().message);
  std::optional<MotionRegulator> along;
  if (regulator_ && nominal->cost_min_s > 0) {
    along.emplace(
        swing_up_.plant.parameters, nominal->motion,
        [&](double time_s) { return acceleration.at(time_s); }, nominal->cost_min_s, *regulator_);
    if (!along->is_finite()) {
      return Outcome::failed(RolloutStatus::kDiverged,
                             "the gains of the regulator along the motion are not finite");
    }
  }
  const Outcome held = plant_.evaluate(
      seed, swing_up_.start,
      [&](sim::CartPendulumPlant& plant, const sim::CartPendulumState& start) {
        return hold(plant, start, acceleration, *nominal, along ? &*along : nullptr, trace);
      });
  if (!held.is_ok()) return held;
  const double swung_up = elementary::exp(-swing_up_.alpha * nominal->cost_min);
  return Outcome::ok((1 - reward_share_) * swung_up + reward_share_ * held.reward());
}

Outcome SwingUpAndHoldTask::hold(sim::CartPendulumPlant& plant, const sim::CartPendulumState& start,
                                 const FeedForward& acceleration, const Nominal& nominal,
                                 const MotionRegulator* along, Trace* trace) const {
  const double switch_s = nominal.cost_min_s;
  double seen_s = 0;
  sim::CartPendulumState seen = start;
  const auto input = [&](double time_s, const sim::CartPendulumState& state) {
    // ODE asks for the input of a step's middle with the state of its start, which is to be
    // compared with that of the motion then.
    const double state_s = state == seen ? seen_s : time_s;
    double wanted_mps2 = 0;
    if (!regulator_) {
      wanted_mps2 = acceleration.at(time_s);
    } else if (time_s < switch_s) {
      wanted_mps2 = acceleration.at(time_s) + along->correction(state_s, state);
    } else {
      wanted_mps2 = regulator_->acceleration(state);
    }
    return std::clamp(wanted_mps2, -acceleration_max_mps2_, acceleration_max_mps2_);
  };
  Holding holding(holding_);
  const auto end = plant.simulate(
      start, switch_s + holding_.until_s, input,
      [&](double time_s, const sim::CartPendulumState& s, double cart_acceleration_mps2) {
        seen_s = time_s;
        seen = s;
        holding.see(time_s - switch_s, s);
        if (trace == nullptr) return true;
        const sim::StateVector goal =
            time_s < switch_s ? nominal.motion.state(time_s) : sim::StateVector::Zero();
        const bool is_asked = !regulator_ || time_s < switch_s;
        trace->add_row({time_s, s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate,
                        cart_acceleration_mps2, swing_up_cost(s), goal[0], goal[1], goal[2],
                        is_asked ? acceleration.at(time_s) : 0, holding.holds() ? 1. : 0.});
        if (links_) trace->add_pose(pose(*links_, s));
        return true;
      });
  if (!end) return Outcome::failed(RolloutStatus::kDiverged, end.error().message);
  return Outcome::ok(holding.holds() ? 1 : 0);
}

std::unique_ptr<Task> make_swing_up(SettingsReader& settings) {
  if (settings.has("feedback")) return std::make_unique<SwingUpAndHoldTask>(settings);
  return std::make_unique<SwingUpTask>(settings);
}

}  // namespace treeroll
