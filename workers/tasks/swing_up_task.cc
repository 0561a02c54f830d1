#include "workers/tasks/swing_up_task.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/cart_pendulum_pose.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/trace.h"

namespace treeroll {
double swing_up_cost(const sim::CartPendulumState& s) {
  constexpr double kPi = std::numbers::pi;
  const double y = 7 * s.y / 10;
  return 5 / (kPi * kPi) * (s.phi1 * s.phi1 + s.phi2 * s.phi2) + y * y * y * y +
         (s.phi1_rate * s.phi1_rate + s.phi2_rate * s.phi2_rate + s.y_rate * s.y_rate) / 50;
}

SwingUpSettings read_swing_up_settings(SettingsReader& settings) {
  SwingUpSettings read;
  read.plant = sim::read_plant_settings(settings);
  read.variation = read_plant_variation(settings);
  read.duration_s = settings.number("duration_s", kSimulatedTime, read.duration_s,
                                    {.meaning = "Simulated time", .unit = "s"});
  read.alpha = settings.number("alpha", kPositive, read.alpha,
                               {.meaning = "Of the reward exp(-alpha min c), (4-7)"});
  read.time_limit_s = read_time_limit_s(settings);
  read.start.phi1 = settings.number(
      "start_phi1", kAngle, -std::numbers::pi,
      {.meaning = "First angle at the start, at rest; 0 is upright", .unit = "rad"});
  read.start.phi2 = settings.number("start_phi2", kAngle, -std::numbers::pi,
                                    {.meaning = "Second angle at the start", .unit = "rad"});
  return read;
}

SwingUpTask::SwingUpTask(SettingsReader& settings)
    : SwingUpTask(read_swing_up_settings(settings)) {}

SwingUpTask::SwingUpTask(const SwingUpSettings& settings)
    : duration_s_(settings.duration_s),
      alpha_(settings.alpha),
      time_limit_s_(settings.time_limit_s),
      start_(settings.start),
      links_(visible_links(settings.plant, settings.variation)),
      plant_(settings.plant, settings.variation),
      input_times_s_(plant_.plant().input_times(duration_s_)) {}

TaskDescription SwingUpTask::description() const {
  return {.input_dim = 1,
          .output_dim = 1,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = plant_.deterministic()};
}

Outcome SwingUpTask::evaluate(Controller& controller, std::uint64_t seed) {
  return roll_out(controller, seed, nullptr);
}

Outcome SwingUpTask::evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) {
  trace.set_columns({"time_s", "phi1_rad", "phi2_rad", "y_m", "phi1_rate_radps", "phi2_rate_radps",
                     "y_rate_mps", "cart_acceleration_mps2", "cost"});
  trace.set_policy_columns({"time_s"}, {"cart_acceleration_mps2"});
  return roll_out(controller, seed, &trace);
}

Outcome SwingUpTask::roll_out(Controller& controller, std::uint64_t seed, Trace* trace) {
  CHECK(controller.input_dim() == 1 && controller.output_dim() == 1,
        "a controller from time to acceleration");
  return plant_.evaluate(
      seed, start_, [&](sim::CartPendulumPlant& plant, const sim::CartPendulumState& start) {
        double cost_min = std::numeric_limits<double>::infinity();
        const auto see = [&](double time_s, const sim::CartPendulumState& s,
                             double cart_acceleration_mps2) {
          const double cost = swing_up_cost(s);
          cost_min = std::min(cost_min, cost);
          if (trace != nullptr) {
            trace->add_row({time_s, s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate,
                            cart_acceleration_mps2, cost});
            if (links_) trace->add_pose(pose(*links_, s));
          }
          return true;
        };
        if (!input_times_s_.empty()) {
          const std::vector<double> inputs = accelerations(controller);
          const sim::OpenLoop rollout = {.start = start, .accelerations = inputs};
          const auto ends = plant.simulate_open_loop(
              {&rollout, 1}, duration_s_,
              [&](std::size_t, double time_s, const sim::CartPendulumState& s, double input) {
                see(time_s, s, input);
              });
          return outcome(ends[0], cost_min);
        }
        controller.start();
        const auto end = plant.simulate(
            start, duration_s_,
            [&](double time_s, const sim::CartPendulumState&) { return controller.act(time_s); },
            see);
        return outcome(end, cost_min);
      });
}

bool SwingUpTask::side_by_side() const {
  return plant_.deterministic() && plant_.plant().side_by_side();
}

std::vector<Outcome> SwingUpTask::evaluate_all(std::span<const Evaluation> evaluations) {
  if (!side_by_side()) return Task::evaluate_all(evaluations);
  std::vector<std::vector<double>> inputs;
  std::vector<sim::OpenLoop> rollouts;
  for (const Evaluation& one : evaluations) inputs.push_back(accelerations(one.controller));
  for (const auto& of_one : inputs) rollouts.push_back({.start = start_, .accelerations = of_one});
  std::vector<double> cost_min(rollouts.size(), std::numeric_limits<double>::infinity());
  const auto ends = plant_.plant().simulate_open_loop(
      rollouts, duration_s_,
      [&](std::size_t rollout, double, const sim::CartPendulumState& s, double) {
        cost_min[rollout] = std::min(cost_min[rollout], swing_up_cost(s));
      });
  std::vector<Outcome> outcomes;
  for (std::size_t i = 0; i < ends.size(); ++i) outcomes.push_back(outcome(ends[i], cost_min[i]));
  return outcomes;
}

std::vector<double> SwingUpTask::accelerations(Controller& controller) const {
  std::vector<double> outputs(input_times_s_.size());
  controller.start();
  controller.act_all(input_times_s_, outputs);
  return outputs;
}

Outcome SwingUpTask::outcome(const Result<sim::CartPendulumState>& end, double cost_min) const {
  if (!end) return Outcome::failed(RolloutStatus::kDiverged, end.error().message);
  return Outcome::ok(elementary::exp(-alpha_ * cost_min));
}

}  // namespace treeroll
