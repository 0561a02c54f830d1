#pragma once

#include <optional>

#include "workers/tasks/holding.h"
#include "workers/tasks/lqr_tracking.h"
#include "workers/tasks/plant_variation.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Holding the double pendulum at rest by feedback: the policy gives the acceleration of the cart
/// in m/s^2 for the state (closed loop), six inputs in this order, in rad, m and s:
///   phi1 - target, phi2 - target, y, phi1_rate, phi2_rate, y_rate
/// The reward is exp(-alpha times the mean over time of c), c the cost (4-6) about the target.
/// Hanging, friction alone damps it slowly; upright, it falls without the right feedback.
///
/// Settings, beside those of the plant (sim/plant_settings.h) and `variation` (plant_variation.h):
///   target = "hanging"             # phi1 = phi2 = -pi; or "upright": 0
///   start_phi1 = .3                # rad from the target, at rest
///   start_phi2 = -.2
///   duration_s = 5                 # simulated time
///   alpha = 10
///   acceleration_max_mps2 = 20     # what the cart can do: outputs are cut to it
///   time_limit_s = 10
/// and, where the key `feedback` is there:
///   feedback = "lqr"               # the policy's acceleration comes on top of that of the linear
///                                  # quadratic regulator about the target; or "none": alone
///   lqr = {..}                     # lqr_tracking.h; with feedback "lqr"
///   holds = {after_s = 1.5, angle_max_rad = .2}   # holding.h, from the start to duration_s: told
///                                                 # in the trace, the reward is the same
class HoldTask : public Task {
 public:
  /// Throws ConfigError.
  explicit HoldTask(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  /// Columns: time, the policy's inputs (angles from the target), what it gave within what the cart
  /// can do, and the cost; with the key `feedback` also what the policy gave, and whether the plant
  /// has been held so far.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 private:
  SignalNames signals() const;
  /// @param trace  may be null
  Outcome roll_out(Controller& controller, std::uint64_t seed, Trace* trace);

  double target_rad_;
  sim::CartPendulumState start_;
  double duration_s_;
  double alpha_;
  double acceleration_max_mps2_;
  double time_limit_s_;
  std::optional<RestRegulator> regulator_;
  std::optional<HoldingRule> holding_;  ///< nothing without the key `feedback`
  VariedPlant plant_;
};

}  // namespace treeroll
