#include "workers/tasks/track_task.h"

#include <numbers>

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/cart_pendulum_pose.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/time_mean.h"
#include "workers/tasks/trace.h"

namespace treeroll {
namespace {

constexpr std::size_t kAmplitudesMax = 16;

double distance(const sim::CartPendulumState& state, const sim::CartPendulumState& goal) {
  const double phi1 = state.phi1 - goal.phi1;
  const double phi2 = state.phi2 - goal.phi2;
  const double y = state.y - goal.y;
  return (phi1 * phi1 + phi2 * phi2 + y * y) / 3;
}

sim::CartPendulumState hanging_at(const std::vector<double>& amplitudes_m) {
  sim::CartPendulumState state{.phi1 = -std::numbers::pi, .phi2 = -std::numbers::pi};
  for (const double amplitude : amplitudes_m) state.y += amplitude;
  return state;
}

/// @param links  takes what is seen of it
VariedPlant read_plant(SettingsReader& settings, std::optional<sim::DoublePendulum>& links) {
  const sim::PlantSettings plant = sim::read_plant_settings(settings);
  const PlantVariation variation = read_plant_variation(settings);
  links = visible_links(plant, variation);
  return {plant, variation};
}

/// How far a roll-out has been from its goal, output step by output step.
class Distance {
 public:
  explicit Distance(const std::vector<sim::CartPendulumState>& goal) : goal_(&goal) {}
  const sim::CartPendulumState& see(double time_s, const sim::CartPendulumState& state) {
    const sim::CartPendulumState& goal = goal_->at(next_++);
    mean_.see(time_s, distance(state, goal));
    return goal;
  }
  double mean() const { return mean_.mean(); }

 private:
  const std::vector<sim::CartPendulumState>* goal_;
  std::size_t next_ = 0;
  TimeMean mean_;
};

}  // namespace

TrackTask::TrackTask(SettingsReader& settings)
    : amplitudes_m_(settings.numbers(
          "amplitudes", {.min = -10, .max = 10}, 1, kAmplitudesMax, std::vector<double>{.3, -.05},
          {.meaning = "Of the cosines that the cart's path is the sum of", .unit = "m"})),
      duration_s_(settings.number("duration_s", kSimulatedTime, 4,
                                  {.meaning = "Simulated time", .unit = "s"})),
      alpha_(settings.number("alpha", kPositive, 5,
                             {.meaning = "How steeply the reward falls with the distance"})),
      time_limit_s_(read_time_limit_s(settings)),
      plant_(read_plant(settings, links_)),
      start_(hanging_at(amplitudes_m_)),
      input_times_s_(plant_.plant().input_times(duration_s_)) {
  const auto path_mps2 = [&](double time_s, const sim::CartPendulumState&) {
    double sum = 0;
    for (std::size_t k = 0; k < amplitudes_m_.size(); ++k) {
      const double rate = static_cast<double>(k + 1) * std::numbers::pi / duration_s_;
      sum -= amplitudes_m_[k] * rate * rate * elementary::cos(rate * time_s);
    }
    return sum;
  };
  const auto end = plant_.plant().simulate(
      start_, duration_s_, path_mps2, [&](double, const sim::CartPendulumState& state, double) {
        goal_.push_back(state);
        return true;
      });
  if (!end) settings.refuse("amplitudes", "the plant cannot follow: " + end.error().message);
}

TaskDescription TrackTask::description() const {
  return {.input_dim = 1,
          .output_dim = 1,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = plant_.deterministic()};
}

Outcome TrackTask::evaluate(Controller& controller, std::uint64_t seed) {
  return roll_out(controller, seed, nullptr);
}

Outcome TrackTask::evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) {
  trace.set_columns({"time_s", "phi1_rad", "phi2_rad", "y_m", "phi1_rate_radps", "phi2_rate_radps",
                     "y_rate_mps", "cart_acceleration_mps2", "goal_phi1_rad", "goal_phi2_rad",
                     "goal_y_m"});
  trace.set_policy_columns({"time_s"}, {"cart_acceleration_mps2"});
  return roll_out(controller, seed, &trace);
}

Outcome TrackTask::roll_out(Controller& controller, std::uint64_t seed, Trace* trace) {
  CHECK(controller.input_dim() == 1 && controller.output_dim() == 1,
        "a controller from time to acceleration");
  return plant_.evaluate(
      seed, start_, [&](sim::CartPendulumPlant& plant, const sim::CartPendulumState& start) {
        Distance so_far(goal_);
        const auto see = [&](double time_s, const sim::CartPendulumState& s,
                             double cart_acceleration_mps2) {
          const sim::CartPendulumState& goal = so_far.see(time_s, s);
          if (trace != nullptr) {
            trace->add_row({time_s, s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate,
                            cart_acceleration_mps2, goal.phi1, goal.phi2, goal.y});
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
          return outcome(ends[0], so_far.mean());
        }
        controller.start();
        const auto end = plant.simulate(
            start, duration_s_,
            [&](double time_s, const sim::CartPendulumState&) { return controller.act(time_s); },
            see);
        return outcome(end, so_far.mean());
      });
}

bool TrackTask::side_by_side() const {
  return plant_.deterministic() && plant_.plant().side_by_side();
}

std::vector<Outcome> TrackTask::evaluate_all(std::span<const Evaluation> evaluations) {
  if (!side_by_side()) return Task::evaluate_all(evaluations);
  std::vector<std::vector<double>> inputs;
  std::vector<sim::OpenLoop> rollouts;
  for (const Evaluation& one : evaluations) inputs.push_back(accelerations(one.controller));
  for (const auto& of_one : inputs) rollouts.push_back({.start = start_, .accelerations = of_one});
  std::vector<Distance> so_far(rollouts.size(), Distance(goal_));
  const auto ends = plant_.plant().simulate_open_loop(
      rollouts, duration_s_,
      [&](std::size_t rollout, double time_s, const sim::CartPendulumState& s, double) {
        so_far[rollout].see(time_s, s);
      });
  std::vector<Outcome> outcomes;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    outcomes.push_back(outcome(ends[i], so_far[i].mean()));
  }
  return outcomes;
}

std::vector<double> TrackTask::accelerations(Controller& controller) const {
  std::vector<double> outputs(input_times_s_.size());
  controller.start();
  controller.act_all(input_times_s_, outputs);
  return outputs;
}

Outcome TrackTask::outcome(const Result<sim::CartPendulumState>& end, double mean) const {
  if (!end) return Outcome::failed(RolloutStatus::kDiverged, end.error().message);
  return Outcome::ok(elementary::exp(-alpha_ * mean));
}

}  // namespace treeroll
