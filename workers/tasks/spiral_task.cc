#include "workers/tasks/spiral_task.h"

#include <numbers>

#include "common/base/elementary.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/setting_rules.h"

namespace treeroll {
namespace {

constexpr std::int64_t kSamplesMax = 100'000;

GoalTrajectory read_goal(SettingsReader& settings) {
  const double duration = settings.number("duration", kPathDuration, 5 * std::numbers::pi);
  const auto num_samples = static_cast<int>(settings.integer("samples", 1, kSamplesMax, 100));
  GoalTrajectory goal{.times_s = sample_times(duration, num_samples),
                      .outputs = Eigen::MatrixXd(2, num_samples)};
  for (int i = 0; i < num_samples; ++i) {
    const double t = goal.times_s[static_cast<std::size_t>(i)];
    goal.outputs.col(i) << elementary::sin(t), elementary::cos(t);
  }
  return goal;
}

}  // namespace

SpiralTask::SpiralTask(SettingsReader& settings)
    : alpha_(settings.number("alpha", kPositive, 5)),
      time_limit_s_(settings.number("time_limit_s", kTimeLimit, 10)),
      goal_(read_goal(settings)) {}

TaskDescription SpiralTask::description() const {
  return {.input_dim = 1,
          .output_dim = 2,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = true};
}

Evaluation SpiralTask::evaluate(const Gmm& policy, std::uint64_t /*seed*/) {
  return {.reward = trajectory_reward(goal_, alpha_, policy)};
}

Evaluation SpiralTask::evaluate_traced(const Gmm& policy, std::uint64_t /*seed*/, Trace& trace) {
  return {.reward = traced_trajectory_reward(goal_, alpha_, policy, "t", {"x", "y"}, trace)};
}

}  // namespace treeroll
