#include "workers/tasks/goal_trajectory.h"

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/policy/gmr.h"

namespace treeroll {

std::vector<double> sample_times(double duration_s, int num_samples) {
  std::vector<double> times_s;
  for (int i = 0; i < num_samples; ++i) times_s.push_back(duration_s * (i + .5) / num_samples);
  return times_s;
}

double trajectory_reward(const GoalTrajectory& goal, double alpha, const Gmm& policy) {
  CHECK(policy.input_dim() == 1 && policy.output_dim() == goal.outputs.rows(),
        "a policy from time to the outputs of the goal");
  const Gmr gmr(policy);
  Eigen::VectorXd time_s(1);
  double sum = 0;
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    time_s[0] = goal.times_s[i];
    const Eigen::VectorXd outputs = gmr.regress(time_s);
    for (Eigen::Index o = 0; o < outputs.size(); ++o) {
      const double miss = outputs[o] - goal.outputs(o, static_cast<Eigen::Index>(i));
      sum += miss * miss;
    }
  }
  return elementary::exp(-alpha * sum / static_cast<double>(goal.times_s.size()));
}

}  // namespace treeroll
