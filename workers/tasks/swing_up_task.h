#pragma once

#include <optional>
#include <span>
#include <vector>

#include "workers/tasks/plant_variation.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Distance of a state from upright, at rest, in the middle of the track; thesis (4-6). The angles
/// count as they are, not modulo a turn: going once round is not upright.
double swing_up_cost(const sim::CartPendulumState& state);

/// The keys of SwingUpTask, which swinging up and holding has too.
struct SwingUpSettings {
  sim::PlantSettings plant;
  PlantVariation variation;
  double duration_s = 2.5;
  double alpha = .25;
  double time_limit_s = 10;
  sim::CartPendulumState start;
};
/// Throws ConfigError.
SwingUpSettings read_swing_up_settings(SettingsReader& settings);

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
class SwingUpTask : public Task {
 public:
  /// Throws ConfigError.
  explicit SwingUpTask(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  std::vector<Outcome> evaluate_all(std::span<const Evaluation> evaluations) override;
  /// Variations make a plant an evaluation, and step control a time grid an evaluation.
  bool side_by_side() const override;
  /// Columns: time, state, input and cost of (4-6), at each output step of the plant; poses: the
  /// cart and the links, unless their lengths vary.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 private:
  explicit SwingUpTask(const SwingUpSettings& settings);
  /// @param trace  may be null
  Outcome roll_out(Controller& controller, std::uint64_t seed, Trace* trace);

  /// What the controller gives at input_times_s_, from its start.
  std::vector<double> accelerations(Controller& controller) const;
  /// Of the lowest cost of a simulation that did not diverge, (4-7).
  Outcome outcome(const Result<sim::CartPendulumState>& end, double cost_min) const;

  double duration_s_;
  double alpha_;
  double time_limit_s_;
  sim::CartPendulumState start_;
  std::optional<sim::DoublePendulum> links_;  ///< nothing if they vary
  VariedPlant plant_;
  std::vector<double> input_times_s_;  ///< of the plant; empty with step control
};

}  // namespace treeroll
