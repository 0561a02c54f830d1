#pragma once

#include <cstdint>
#include <optional>

#include "workers/tasks/feed_forward.h"
#include "workers/tasks/holding.h"
#include "workers/tasks/lqr_tracking.h"
#include "workers/tasks/plant_variation.h"
#include "workers/tasks/swing_up_task.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Swing up and hold: `swing_up` with the key `feedback`. What is learnt is the same acceleration
/// of the cart over time. A roll-out has two parts:
///
/// 1. On the plant of the settings the acceleration alone gives the nominal motion, with its
///    instant of least cost (4-6).
/// 2. On each plant of `variation` the cart starts again. With feedback "lqr" it is driven by the
///    acceleration and a time-varying linear quadratic regulator along the nominal motion, and from
///    the instant of least cost on by the regulator of the upright rest. With "none" the
///    acceleration goes on alone.
///
/// The plant holds if both angles are small from holds.after_s to holds.until_s after that instant.
/// The reward is (1 - share) exp(-alpha least nominal cost), (4-7), and share times the part of the
/// plants that hold. So with the default share, half, it is above half only where plants hold.
///
/// Settings, beside those of `swing_up`:
///   feedback = "lqr"               # or "none"
///   acceleration_max_mps2 = 20     # what the cart can do: all accelerations are cut to it
///   lqr = {..}                     # lqr_tracking.h; with feedback "lqr"
///   holds = {after_s = 1.5, until_s = 5, angle_max_rad = .2, reward_share = .5}
class SwingUpAndHoldTask : public Task {
 public:
  /// Throws ConfigError.
  explicit SwingUpAndHoldTask(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  /// Of the second part, plant after plant: time, state, input and cost, what the state ought to be
  /// (the nominal motion, then upright), what the policy gave, and whether it has held so far. A
  /// plant's last row has the verdict. Poses as those of `swing_up`.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 private:
  struct Nominal {
    NominalMotion motion;
    double cost_min = 0;
    double cost_min_s = 0;  ///< the first instant of it
  };

  SwingUpAndHoldTask(SettingsReader& settings, bool has_feedback);
  /// @param trace  may be null
  Outcome roll_out(Controller& controller, std::uint64_t seed, Trace* trace);
  Result<Nominal> nominal(const FeedForward& acceleration);
  /// Reward 1 if the plant holds, else 0.
  Outcome hold(sim::CartPendulumPlant& plant, const sim::CartPendulumState& start,
               const FeedForward& acceleration, const Nominal& nominal,
               const MotionRegulator* along, Trace* trace) const;

  TimeDrivenSettings swing_up_;
  double acceleration_max_mps2_;
  std::optional<RestRegulator> regulator_;  ///< nothing without feedback
  HoldingRule holding_;
  double reward_share_ = .5;
  std::optional<sim::DoublePendulum> links_;  ///< nothing if they vary
  VariedPlant plant_;
};

/// The one or the other, as the key `feedback` is absent or not.
std::unique_ptr<Task> make_swing_up(SettingsReader& settings);

}  // namespace treeroll
