#pragma once

#include <memory>

#include "workers/tasks/goal_trajectory.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// Following a trajectory, thesis sections 4-1, 4-2 and A-4-3. The policy gives the outputs for the
/// time; the reward is exp(-alpha times the mean over samples of the squared distance to the goal),
/// (4-1), (A-37).
class TrajectoryTask : public Task {
 public:
  TrajectoryTask(GoalTrajectory goal, double alpha, double time_limit_s);

  /// The task "trajectory", whose goal a mixture generates, or is a recording. Throws ConfigError.
  /// Settings:
  ///   duration_s = 2
  ///   samples = 100              # at duration_s (i + .5) / samples
  ///   alpha = 20
  ///   time_limit_s = 10
  ///   [goal]                     # one input, any number of outputs
  ///   outputs = [1.25, .75, -.75, -1.25]
  ///   deviations = [.25, .3]
  /// The goal is a mixture as common/mixture/mixture_settings.h reads it, equally spaced over the
  /// duration unless a range or means are given. A recorded goal takes the place of `duration_s`
  /// and `samples` too: each of its rows is a sample.
  ///   [goal]
  ///   columns = ["t_s", "x_m"]   # the first is the time; the names are those of the trace
  ///   rows = [[0, .1], [.1, .3]] # or csv_file = "goal.csv", of which a study takes the rows
  static std::unique_ptr<Task> with_goal(SettingsReader& settings);

  /// The task "spiral" of section A-4-3: two outputs that go round a circle over time, (A-35).
  /// Throws ConfigError. Settings:
  ///   duration = 15.70...     # 5 pi, what the six Gaussians of reach from 0
  ///   samples = 100           # at duration (i + .5) / samples
  ///   alpha = 5
  ///   time_limit_s = 10
  static std::unique_ptr<Task> spiral(SettingsReader& settings);

  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  /// Columns: the time, the outputs and their goals, at each sample.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 private:
  /// What the controller gives at the goal's times: dO numbers each, as goal_.outputs has them.
  std::vector<double> follow(Controller& controller) const;
  Outcome outcome(const std::vector<double>& outputs) const;

  GoalTrajectory goal_;
  double alpha_;
  double time_limit_s_;
};

}  // namespace treeroll
