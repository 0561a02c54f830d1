#include "workers/tasks/goal_trajectory.h"

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/policy/gmr.h"
#include "workers/tasks/trace.h"

namespace treeroll {

std::vector<double> sample_times(double duration_s, int num_samples) {
  std::vector<double> times_s;
  for (int i = 0; i < num_samples; ++i) times_s.push_back(duration_s * (i + .5) / num_samples);
  return times_s;
}

namespace {

/// @param see  called with each sample and the policy's outputs there
template <class Visitor>
double reward(const GoalTrajectory& goal, double alpha, const Gmm& policy, const Visitor& see) {
  CHECK(policy.input_dim() == 1 && policy.output_dim() == goal.outputs.rows(),
        "a policy from time to the outputs of the goal");
  const Gmr gmr(policy);
  Eigen::VectorXd time_s(1);
  double sum = 0;
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    time_s[0] = goal.times_s[i];
    const Eigen::VectorXd outputs = gmr.regress(time_s);
    see(i, outputs);
    for (Eigen::Index o = 0; o < outputs.size(); ++o) {
      const double miss = outputs[o] - goal.outputs(o, static_cast<Eigen::Index>(i));
      sum += miss * miss;
    }
  }
  return elementary::exp(-alpha * sum / static_cast<double>(goal.times_s.size()));
}

}  // namespace

double trajectory_reward(const GoalTrajectory& goal, double alpha, const Gmm& policy) {
  return reward(goal, alpha, policy, [](std::size_t, const Eigen::VectorXd&) {});
}

double traced_trajectory_reward(const GoalTrajectory& goal, double alpha, const Gmm& policy,
                                const std::string& input, const std::vector<std::string>& outputs,
                                Trace& trace) {
  std::vector<std::string> columns = {input};
  columns.insert(columns.end(), outputs.begin(), outputs.end());
  for (const std::string& name : outputs) columns.push_back("goal_" + name);
  trace.set_columns(columns);
  trace.set_policy_columns({input}, outputs);
  return reward(goal, alpha, policy, [&](std::size_t i, const Eigen::VectorXd& given) {
    const Eigen::VectorXd wanted = goal.outputs.col(static_cast<Eigen::Index>(i));
    std::vector<double> row = {goal.times_s[i]};
    row.insert(row.end(), given.begin(), given.end());
    row.insert(row.end(), wanted.begin(), wanted.end());
    trace.add_row(row);
  });
}

}  // namespace treeroll
