#include "workers/tasks/trajectory_task.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "common/base/settings_reader.h"
#include "common/policy/gmr.h"
#include "common/policy/mixture_settings.h"
#include "workers/tasks/setting_rules.h"

namespace treeroll {
namespace {

constexpr std::int64_t kSamplesMax = 100'000;

GoalTrajectory read_goal(SettingsReader& settings) {
  const double duration_s = settings.number("duration_s", kPathDuration, 2);
  const auto num_samples = static_cast<int>(settings.integer("samples", 1, kSamplesMax, 100));
  SettingsReader table = settings.table("goal");
  const Gmm mixture = read_mixture(table, std::array{0., duration_s});
  if (mixture.input_dim() != 1) table.refuse("inputs", "must be 1: a trajectory is over time");
  table.finish();
  const Gmr gmr(mixture);
  GoalTrajectory goal{.times_s = sample_times(duration_s, num_samples),
                      .outputs = Eigen::MatrixXd(mixture.output_dim(), num_samples)};
  for (int i = 0; i < num_samples; ++i) {
    const Eigen::VectorXd time_s =
        Eigen::VectorXd::Constant(1, goal.times_s[static_cast<std::size_t>(i)]);
    goal.outputs.col(i) = gmr.regress(time_s);
  }
  return goal;
}

}  // namespace

TrajectoryTask::TrajectoryTask(SettingsReader& settings)
    : alpha_(settings.number("alpha", kPositive, 20)),
      time_limit_s_(settings.number("time_limit_s", kTimeLimit, 10)),
      goal_(read_goal(settings)) {}

TaskDescription TrajectoryTask::description() const {
  return {.input_dim = 1,
          .output_dim = static_cast<int>(goal_.outputs.rows()),
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = true};
}

Evaluation TrajectoryTask::evaluate(const Gmm& policy, std::uint64_t /*seed*/) {
  return {.reward = trajectory_reward(goal_, alpha_, policy)};
}

Evaluation TrajectoryTask::evaluate_traced(const Gmm& policy, std::uint64_t /*seed*/,
                                           Trace& trace) {
  std::vector<std::string> outputs = {"x"};
  if (goal_.outputs.rows() > 1) {
    outputs.clear();
    for (Eigen::Index o = 1; o <= goal_.outputs.rows(); ++o) {
      outputs.push_back("x" + std::to_string(o));
    }
  }
  return {.reward = traced_trajectory_reward(goal_, alpha_, policy, "time_s", outputs, trace)};
}

}  // namespace treeroll
