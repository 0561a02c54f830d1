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

/// The middles of `num_samples` equal parts of [0, duration_s].
std::vector<double> sample_times(double duration_s, int num_samples);

/// What a mixture over [time; outputs] regresses to, its inputs `duration_s` and `samples` of
/// TrajectoryTask and the table `goal` (common/mixture/mixture_settings.h). Throws ConfigError.
GoalTrajectory read_mixture_goal(SettingsReader& settings);

/// Round a circle over time, (A-35), its inputs `duration` and `samples`. Throws ConfigError.
GoalTrajectory read_spiral_goal(SettingsReader& settings);

}  // namespace treeroll
