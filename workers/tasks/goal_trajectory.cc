#include "workers/tasks/goal_trajectory.h"

#include <fmt/format.h>

#include <array>
#include <numbers>
#include <set>

#include "common/mixture/gmr.h"
#include "common/mixture/mixture_settings.h"
#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

/// Nothing is simulated, so the time may be in any unit.
constexpr NumberRule kDuration{.min = 0, .max = 1e6, .min_allowed = false};
constexpr std::int64_t kSamplesMax = 100'000;
constexpr NumberRule kRecorded{.min = -1e20, .max = 1e20};
constexpr std::size_t kRecordedColumnsMax = 33;

std::vector<double> read_times(SettingsReader& settings, double duration_s) {
  return sample_times(duration_s,
                      static_cast<int>(settings.integer(
                          "samples", 1, kSamplesMax, 100,
                          {.meaning = "At how many times the outputs are compared with the goal: "
                                      "the middles of equal parts of the duration"})));
}

}  // namespace

std::string goal_column(const std::string& name) { return "goal_" + name; }

std::vector<double> sample_times(double duration_s, int num_samples) {
  std::vector<double> times_s;
  for (int i = 0; i < num_samples; ++i) times_s.push_back(duration_s * (i + .5) / num_samples);
  return times_s;
}

GoalTrajectory read_mixture_goal(SettingsReader& settings) {
  const double duration_s =
      settings.number("duration_s", kDuration, 2, {.meaning = "Of the trajectory", .unit = "s"});
  GoalTrajectory goal{
      .times_s = read_times(settings, duration_s), .outputs = {}, .time_name = "time_s"};
  SettingsReader table = settings.table("goal");
  const Gmm mixture = read_mixture(table, std::array{0., duration_s});
  if (mixture.input_dim() != 1) table.refuse("inputs", "must be 1: a trajectory is over time");
  table.finish();
  const Gmr gmr(mixture);
  goal.outputs.resize(mixture.output_dim(), static_cast<Eigen::Index>(goal.times_s.size()));
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    goal.outputs.col(static_cast<Eigen::Index>(i)) =
        gmr.regress(Eigen::VectorXd::Constant(1, goal.times_s[i]));
  }
  for (int o = 1; o <= mixture.output_dim(); ++o) {
    goal.names.push_back(mixture.output_dim() == 1 ? "x" : "x" + std::to_string(o));
  }
  return goal;
}

GoalTrajectory read_recorded_goal(SettingsReader& settings) {
  SettingsReader table = settings.table("goal");
  const std::vector<std::string> columns =
      table.strings("columns", kRecordedColumnsMax,
                    {.meaning = "Of a recorded goal: the name of the time, then of each output",
                     .example = "[\"t_s\", \"x_m\"]"});
  if (columns.size() < 2) table.refuse("columns", "must name the time and at least one output");
  GoalTrajectory goal{.times_s = {},
                      .outputs = {},
                      .time_name = columns.front(),
                      .names = {columns.begin() + 1, columns.end()}};
  // A trace has a column for each, and one for the goal of each output.
  std::set<std::string> names(columns.begin(), columns.end());
  for (const std::string& name : goal.names) names.insert(goal_column(name));
  if (names.size() != columns.size() + goal.names.size()) {
    table.refuse("columns", "must differ, and none may be another one's goal_NAME");
  }
  const auto rows = table.rows(
      "rows", kRecorded, kSamplesMax, columns.size(), columns.size(), {},
      {.meaning = "Of a recorded goal, in place of a mixture: a row a sample, the time first and "
                  "growing; csv_file = \"goal.csv\" in their place takes them from a file",
       .rule = "a number for each of columns",
       .example = "[[0.0, 0.1], [0.1, 0.3]]"});
  table.finish();
  goal.outputs.resize(static_cast<Eigen::Index>(goal.names.size()),
                      static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i > 0 && !(rows[i][0] > rows[i - 1][0])) {
      table.refuse("rows", fmt::format("the time must grow: row {} is at {}, the one before at {}",
                                       i + 1, rows[i][0], rows[i - 1][0]));
    }
    goal.times_s.push_back(rows[i][0]);
    for (std::size_t o = 0; o < goal.names.size(); ++o) {
      goal.outputs(static_cast<Eigen::Index>(o), static_cast<Eigen::Index>(i)) = rows[i][o + 1];
    }
  }
  return goal;
}

GoalTrajectory read_spiral_goal(SettingsReader& settings) {
  const double duration = settings.number("duration", kDuration, 5 * std::numbers::pi,
                                          {.meaning = "Of the spiral, in units of its time"});
  GoalTrajectory goal{.times_s = read_times(settings, duration),
                      .outputs = {},
                      .time_name = "t",
                      .names = {"x", "y"}};
  goal.outputs.resize(2, static_cast<Eigen::Index>(goal.times_s.size()));
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    const double t = goal.times_s[i];
    goal.outputs.col(static_cast<Eigen::Index>(i)) << elementary::sin(t), elementary::cos(t);
  }
  return goal;
}

}  // namespace treeroll
