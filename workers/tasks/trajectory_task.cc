#include "workers/tasks/trajectory_task.h"

#include <span>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/trace.h"

namespace treeroll {

TrajectoryTask::TrajectoryTask(GoalTrajectory goal, double alpha, double time_limit_s)
    : goal_(std::move(goal)), alpha_(alpha), time_limit_s_(time_limit_s) {}

std::unique_ptr<Task> TrajectoryTask::with_goal(SettingsReader& settings) {
  const double alpha = settings.number("alpha", kPositive, 20);
  const double time_limit_s = read_time_limit_s(settings);
  // With a mixture the times are settings of their own; a recording has its own.
  const bool is_recorded = settings.table("goal").has("rows");
  return std::make_unique<TrajectoryTask>(
      is_recorded ? read_recorded_goal(settings) : read_mixture_goal(settings), alpha,
      time_limit_s);
}

std::unique_ptr<Task> TrajectoryTask::spiral(SettingsReader& settings) {
  const double alpha = settings.number("alpha", kPositive, 5);
  const double time_limit_s = read_time_limit_s(settings);
  return std::make_unique<TrajectoryTask>(read_spiral_goal(settings), alpha, time_limit_s);
}

TaskDescription TrajectoryTask::description() const {
  return {.input_dim = 1,
          .output_dim = static_cast<int>(goal_.outputs.rows()),
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = true};
}

Outcome TrajectoryTask::evaluate(Controller& controller, std::uint64_t /*seed*/) {
  return roll_out(controller, nullptr);
}

Outcome TrajectoryTask::evaluate_traced(Controller& controller, std::uint64_t /*seed*/,
                                        Trace& trace) {
  std::vector<std::string> columns = {goal_.time_name};
  columns.insert(columns.end(), goal_.names.begin(), goal_.names.end());
  for (const std::string& name : goal_.names) columns.push_back(goal_column(name));
  trace.set_columns(columns);
  trace.set_policy_columns({goal_.time_name}, goal_.names);
  return roll_out(controller, &trace);
}

Outcome TrajectoryTask::roll_out(Controller& controller, Trace* trace) {
  const auto output_dim = static_cast<std::size_t>(goal_.outputs.rows());
  CHECK(controller.input_dim() == 1 && controller.output_dim() == goal_.outputs.rows(),
        "a controller from time to the outputs of the goal");
  controller.start();
  // Time, outputs and goals: a row of the trace.
  std::vector<double> row(1 + 2 * output_dim);
  const std::span<double> outputs = std::span(row).subspan(1, output_dim);
  const std::span<double> wanted = std::span(row).last(output_dim);
  double sum = 0;
  for (std::size_t i = 0; i < goal_.times_s.size(); ++i) {
    row[0] = goal_.times_s[i];
    controller.act(std::span(row).first(1), outputs);
    for (std::size_t o = 0; o < output_dim; ++o) {
      wanted[o] = goal_.outputs(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(i));
      const double miss = outputs[o] - wanted[o];
      sum += miss * miss;
    }
    if (trace != nullptr) trace->add_row(row);
  }
  return Outcome::ok(elementary::exp(-alpha_ * sum / static_cast<double>(goal_.times_s.size())));
}

}  // namespace treeroll
