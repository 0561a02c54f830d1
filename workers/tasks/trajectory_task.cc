#include "workers/tasks/trajectory_task.h"

#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/trace.h"

namespace treeroll {

TrajectoryTask::TrajectoryTask(GoalTrajectory goal, double alpha, double time_limit_s)
    : goal_(std::move(goal)), alpha_(alpha), time_limit_s_(time_limit_s) {}

std::unique_ptr<Task> TrajectoryTask::with_goal(SettingsReader& settings) {
  const double alpha =
      settings.number("alpha", kPositive, 20,
                      {.meaning = "Of the reward exp(-alpha mean squared distance), (4-1)"});
  const double time_limit_s = read_time_limit_s(settings);
  // With a mixture the times are settings of their own; a recording has its own.
  const bool is_recorded = settings.table("goal").has("rows");
  return std::make_unique<TrajectoryTask>(
      is_recorded ? read_recorded_goal(settings) : read_mixture_goal(settings), alpha,
      time_limit_s);
}

std::unique_ptr<Task> TrajectoryTask::spiral(SettingsReader& settings) {
  const double alpha =
      settings.number("alpha", kPositive, 5,
                      {.meaning = "Of the reward exp(-alpha mean squared distance), (A-37)"});
  const double time_limit_s = read_time_limit_s(settings);
  return std::make_unique<TrajectoryTask>(read_spiral_goal(settings), alpha, time_limit_s);
}

TaskDescription TrajectoryTask::description() const {
  TaskDescription description{.input_dim = 1,
                              .output_dim = static_cast<int>(goal_.outputs.rows()),
                              .reward_min = 0,
                              .reward_max = 1,
                              .time_limit_s = time_limit_s_,
                              .deterministic = true};
  // Columns of a file may be called anything, which decides nothing.
  SignalNames names{{goal_.time_name}, goal_.names};
  if (!fault_of(names, description.input_dim, description.output_dim)) {
    description.signals = std::move(names);
  }
  return description;
}

Outcome TrajectoryTask::evaluate(Controller& controller, std::uint64_t /*seed*/) {
  return outcome(follow(controller));
}

Outcome TrajectoryTask::evaluate_traced(Controller& controller, std::uint64_t /*seed*/,
                                        Trace& trace) {
  std::vector<std::string> columns = {goal_.time_name};
  columns.insert(columns.end(), goal_.names.begin(), goal_.names.end());
  for (const std::string& name : goal_.names) columns.push_back(goal_column(name));
  trace.set_columns(columns);
  trace.set_policy_columns({goal_.time_name}, goal_.names);

  const std::vector<double> outputs = follow(controller);
  const auto output_dim = static_cast<std::size_t>(goal_.outputs.rows());
  for (std::size_t i = 0; i < goal_.times_s.size(); ++i) {
    std::vector<double> row = {goal_.times_s[i]};
    for (const double* of : {outputs.data(), std::as_const(goal_.outputs).data()}) {
      row.insert(row.end(), of + i * output_dim, of + (i + 1) * output_dim);
    }
    trace.add_row(row);
  }
  return outcome(outputs);
}

std::vector<double> TrajectoryTask::follow(Controller& controller) const {
  CHECK(controller.input_dim() == 1 && controller.output_dim() == goal_.outputs.rows(),
        "a controller from time to the outputs of the goal");
  controller.start();
  std::vector<double> outputs(static_cast<std::size_t>(goal_.outputs.size()));
  controller.act_all(goal_.times_s, outputs);
  return outputs;
}

Outcome TrajectoryTask::outcome(const std::vector<double>& outputs) const {
  double sum = 0;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const double miss = outputs[i] - goal_.outputs.data()[i];
    sum += miss * miss;
  }
  return Outcome::ok(elementary::exp(-alpha_ * sum / static_cast<double>(goal_.times_s.size())));
}

}  // namespace treeroll
