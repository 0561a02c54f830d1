#pragma once

#include <optional>
#include <span>
#include <vector>

#include "workers/tasks/plant_variation.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Tracking through the hanging double pendulum on a cart: the policy gives the acceleration of the
/// cart in m/s^2 for the time in s, and the plant is to move as it does when the cart follows
///
///   y(t) = sum_k amplitudes[k - 1] cos(k pi t / duration_s)
///
/// from rest. The reward is exp(-alpha times the mean over time of ((phi1 - goal)^2 +
/// (phi2 - goal)^2 + (y - goal)^2) / 3), in rad and m.
///
/// Settings, beside those of the plant (sim/plant_settings.h) and `variation` (plant_variation.h):
///   amplitudes = [0.3, -0.05]   # m, 1 to 16 of them
///   duration_s = 4
///   alpha = 5
///   time_limit_s = 10
class TrackTask : public Task {
 public:
  /// Throws ConfigError.
  explicit TrackTask(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  std::vector<Outcome> evaluate_all(std::span<const Evaluation> evaluations) override;
  bool side_by_side() const override;
  /// Columns: time, state, input, the goals of both angles and the position; poses as of
  /// SwingUpTask.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 private:
  Outcome roll_out(Controller& controller, std::uint64_t seed, Trace* trace);
  std::vector<double> accelerations(Controller& controller) const;
  Outcome outcome(const Result<sim::CartPendulumState>& end, double mean) const;

  std::vector<double> amplitudes_m_;
  double duration_s_;
  double alpha_;
  double time_limit_s_;
  std::optional<sim::DoublePendulum> links_;  ///< nothing if they vary
  VariedPlant plant_;
  sim::CartPendulumState start_;
  std::vector<double> input_times_s_;         ///< of the plant; empty with step control
  std::vector<sim::CartPendulumState> goal_;  ///< at the output steps
};

}  // namespace treeroll
