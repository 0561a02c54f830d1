#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace treeroll {

class SettingsReader;

/// A path of outputs over time that a policy is to follow.
struct GoalTrajectory {
  std::vector<double> times_s;
  Eigen::MatrixXd outputs;           ///< dO x N, a column for each of the N times
  std::string time_name;             ///< of the columns of a trace
  std::vector<std::string> names{};  ///< dO
};

/// The column of a trace that says what column `name` ought to be.
std::string goal_column(const std::string& name);

/// The middles of `num_samples` equal parts of [0, duration_s].
std::vector<double> sample_times(double duration_s, int num_samples);

/// What a mixture over [time; outputs] regresses to, its inputs `duration_s` and `samples` of
/// TrajectoryTask and the table `goal` (common/mixture/mixture_settings.h). Throws ConfigError.
GoalTrajectory read_mixture_goal(SettingsReader& settings);

/// The path of the table `goal` as it was recorded, its first column the time: `columns` and `rows`
/// as TrajectoryTask says. Times grow from row to row. Throws ConfigError.
GoalTrajectory read_recorded_goal(SettingsReader& settings);

/// Round a circle over time, (A-35), its inputs `duration` and `samples`. Throws ConfigError.
GoalTrajectory read_spiral_goal(SettingsReader& settings);

}  // namespace treeroll
