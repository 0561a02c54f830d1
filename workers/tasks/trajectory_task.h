#pragma once

#include "workers/tasks/goal_trajectory.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Following a trajectory that a mixture generates, thesis sections 4-1 and 4-2. The policy gives
/// the position for the time in s; the reward is exp(-alpha mean squared distance), (4-1).
///
/// Settings:
///   duration_s = 2
///   samples = 100               # at duration_s (i + .5) / samples
///   alpha = 20
///   time_limit_s = 10
///   [goal]                      # the mixture, as common/policy/mixture_settings.h reads it: one
///   outputs = [1.25, .75, -.75, -1.25]   # input, any number of outputs; equally spaced ones over
///   deviations = [.25, .3]               # the duration, unless a range or means are given
class TrajectoryTask : public Task {
 public:
  /// Throws ConfigError.
  explicit TrajectoryTask(SettingsReader& settings);

  TaskDescription description() const override;
  Evaluation evaluate(const Gmm& policy, std::uint64_t seed) override;
  /// Columns: time in s, the outputs and their goals, at each sample.
  Evaluation evaluate_traced(const Gmm& policy, std::uint64_t seed, Trace& trace) override;

 private:
  double alpha_;
  double time_limit_s_;
  GoalTrajectory goal_;
};

}  // namespace treeroll
