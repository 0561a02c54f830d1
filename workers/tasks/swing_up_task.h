#pragma once

#include <memory>
#include <string>
#include <vector>

#include "workers/tasks/time_driven_task.h"

namespace treeroll {

/// Distance of a state from upright, at rest, in the middle of the track; thesis (4-6). The angles
/// count as they are, not modulo a turn: going once round is not upright.
double swing_up_cost(const sim::CartPendulumState& state);
/// The terms of that sum.
struct SwingUpCost {
  double angles;
  double cart;  ///< its place
  double rates;
};
SwingUpCost swing_up_terms(const sim::CartPendulumState& state);

/// The keys of SwingUpTask, which swinging up and holding has too. Throws ConfigError.
TimeDrivenSettings read_swing_up_settings(SettingsReader& settings);

/// Swing-up of the double pendulum on a cart, thesis section 4-3. The policy gives the acceleration
/// of the cart in m/s^2 for the time in s, (4-3); the reward is exp(-alpha min c_t), (4-7), over
/// the whole roll-out, its start included. A diverged simulation has no reward, however good it was
/// before. With the key `feedback` the task is another one, that holds too
/// (swing_up_and_hold_task.h).
///
/// Settings, beside those of the plant (sim/plant_settings.h) and `variation` (plant_variation.h):
///   duration_s = 2.5        # simulated time
///   alpha = .25             # of (4-7)
///   start_phi1 = -3.14...   # rad; at rest. From -pi the demonstration (4-5) swings up to 0; from
///   start_phi2 = -3.14...   # +pi it would need the opposite sign
///   time_limit_s = 10
class SwingUpTask : public TimeDrivenTask {
 public:
  /// Throws ConfigError.
  explicit SwingUpTask(SettingsReader& settings);

 private:
  std::unique_ptr<Judge> judge() const override;
  std::vector<std::string> judge_columns() const override;
};

}  // namespace treeroll
