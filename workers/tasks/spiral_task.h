#pragma once

#include "workers/tasks/goal_trajectory.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// The spiral of thesis section A-4-3: two outputs that go round a circle over time, (A-35). The
/// reward is exp(-alpha mean squared distance), (A-37).
///
/// Settings:
///   duration = 15.70...     # 5 pi, what the six Gaussians of reach from 0
///   samples = 100           # at duration (i + .5) / samples
///   alpha = 5
///   time_limit_s = 10
class SpiralTask : public Task {
 public:
  /// Throws ConfigError.
  explicit SpiralTask(SettingsReader& settings);

  TaskDescription description() const override;
  Evaluation evaluate(const Gmm& policy, std::uint64_t seed) override;
  /// Columns: t, x, y and their goals, at each sample.
  Evaluation evaluate_traced(const Gmm& policy, std::uint64_t seed, Trace& trace) override;

 private:
  double alpha_;
  double time_limit_s_;
  GoalTrajectory goal_;
};

}  // namespace treeroll
