#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/policy/gmm.h"

namespace treeroll {

class Trace;

/// A path of outputs over time that a policy is to follow.
struct GoalTrajectory {
  std::vector<double> times_s;
  Eigen::MatrixXd outputs;  ///< dO x N, a column for each of the N times
};

/// The middles of `num_samples` equal parts of [0, duration_s].
std::vector<double> sample_times(double duration_s, int num_samples);

/// exp(-alpha times the mean squared distance of policy and goal over the samples): thesis (4-1)
/// and. Precondition: one input, the outputs of the goal.
double trajectory_reward(const GoalTrajectory& goal, double alpha, const Gmm& policy);

/// The same reward; records the samples: input, outputs, and goal_NAME of each output.
double traced_trajectory_reward(const GoalTrajectory& goal, double alpha, const Gmm& policy,
                                const std::string& input, const std::vector<std::string>& outputs,
                                Trace& trace);

}  // namespace treeroll
