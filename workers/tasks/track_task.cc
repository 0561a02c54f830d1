#include "workers/tasks/track_task.h"

#include <numbers>

#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/time_mean.h"

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

std::vector<double> read_amplitudes_m(SettingsReader& settings) {
  return settings.numbers(
      "amplitudes", {.min = -10, .max = 10}, 1, kAmplitudesMax, std::vector<double>{.3, -.05},
      {.meaning = "Of the cosines that the cart's path is the sum of", .unit = "m"});
}

TimeDrivenSettings read_motion(SettingsReader& settings, const std::vector<double>& amplitudes_m) {
  TimeDrivenSettings read;
  read.duration_s =
      settings.number("duration_s", kSimulatedTime, 4, {.meaning = "Simulated time", .unit = "s"});
  read.alpha = settings.number("alpha", kPositive, 5,
                               {.meaning = "How steeply the reward falls with the distance"});
  read.time_limit_s = read_time_limit_s(settings);
  read.plant = sim::read_plant_settings(settings);
  read.variation = read_plant_variation(settings);
  read.start = hanging_at(amplitudes_m);
  return read;
}

}  // namespace

TrackTask::TrackTask(SettingsReader& settings) : TrackTask(settings, read_amplitudes_m(settings)) {}

TrackTask::TrackTask(SettingsReader& settings, const std::vector<double>& amplitudes_m)
    : TimeDrivenTask(read_motion(settings, amplitudes_m)) {
  const auto path_mps2 = [&](double time_s, const sim::CartPendulumState&) {
    double sum = 0;
    for (std::size_t k = 0; k < amplitudes_m.size(); ++k) {
      const double rate = static_cast<double>(k + 1) * std::numbers::pi / duration_s();
      sum -= amplitudes_m[k] * rate * rate * elementary::cos(rate * time_s);
    }
    return sum;
  };
  const auto end = plant().plant().simulate(
      start(), duration_s(), path_mps2, [&](double, const sim::CartPendulumState& state, double) {
        goal_.push_back(state);
        return true;
      });
  if (!end) settings.refuse("amplitudes", "the plant cannot follow: " + end.error().message);
}

std::unique_ptr<TimeDrivenTask::Judge> TrackTask::judge() const {
  /// How far a roll-out has been from its goal, output step by output step.
  class Distance : public Judge {
   public:
    explicit Distance(const std::vector<sim::CartPendulumState>& goal) : goal_(goal) {}
    void see(double time_s, const sim::CartPendulumState& state) override {
      mean_.see(time_s, distance(state, goal_.at(num_seen_++)));
    }
    void append_columns(std::vector<double>& row) const override {
      const sim::CartPendulumState& goal = goal_.at(num_seen_ - 1);
      for (const double number : {goal.phi1, goal.phi2, goal.y}) row.push_back(number);
    }
    double loss() const override { return mean_.mean(); }

   private:
    const std::vector<sim::CartPendulumState>& goal_;
    std::size_t num_seen_ = 0;
    TimeMean mean_;
  };
  return std::make_unique<Distance>(goal_);
}

std::vector<std::string> TrackTask::judge_columns() const {
  return {"goal_phi1_rad", "goal_phi2_rad", "goal_y_m"};
}

}  // namespace treeroll
