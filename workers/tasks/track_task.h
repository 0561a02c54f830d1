#pragma once

#include <memory>
#include <string>
#include <vector>

#include "workers/tasks/time_driven_task.h"

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
class TrackTask : public TimeDrivenTask {
 public:
  /// Throws ConfigError.
  explicit TrackTask(SettingsReader& settings);

 private:
  /// @param amplitudes_m  of the cart's path, on which the plant starts
  TrackTask(SettingsReader& settings, const std::vector<double>& amplitudes_m);
  std::unique_ptr<Judge> judge() const override;
  /// The goals of both angles and the position.
  std::vector<std::string> judge_columns() const override;

  std::vector<sim::CartPendulumState> goal_;  ///< at the output steps
};

}  // namespace treeroll
