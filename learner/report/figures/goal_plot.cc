#include <fmt/format.h>

#include <algorithm>

#include "learner/report/figures/data_sets.h"
#include "learner/report/figures/policy_plot.h"

namespace treeroll::report {
namespace {

/// Columns with a goal that a picture of the policy does not show.
std::vector<std::string> other_goals(const LearntPolicy& policy) {
  std::vector<std::string> names;
  if (!policy.start_rollout && !policy.best_rollout) return names;
  const RolloutTrace& trace =
      policy.best_rollout ? policy.best_rollout->trace : policy.start_rollout->trace;
  for (std::size_t i = 1; i < trace.columns.size(); ++i) {
    const std::string& name = trace.columns[i];
    const auto& outputs = trace.policy_outputs;
    const bool is_shown = policy.start->input_dim() == 1 &&
                          std::find(outputs.begin(), outputs.end(), name) != outputs.end();
    if (!is_shown && column_of(trace, goal_of(name))) names.push_back(name);
  }
  return names;
}

std::string goal_panel(const LearntPolicy& policy, const std::string& name, DataSets& data) {
  std::string goal;
  std::string lines;
  std::string across;
  int type = 1;
  for (const auto* rollout : {&policy.best_rollout, &policy.start_rollout}) {
    const int line_type = type++;
    if (!*rollout) continue;
    const RolloutTrace& trace = (*rollout)->trace;
    const auto values = column_of(trace, name);
    const auto wanted = column_of(trace, goal_of(name));
    if (!values || !wanted) continue;
    across = trace.columns.front();
    const auto over = *column_of(trace, across);
    if (goal.empty()) {
      goal = fmt::format("data index {} using 1:2 with lines lt 9 notitle",
                         add_curve("goal", over, *wanted, data));
    }
    lines +=
        fmt::format(", data index {} using 1:2 with lines lt {} notitle",
                    add_curve(line_type == 1 ? "best" : "start", over, *values, data), line_type);
  }
  return fmt::format(
      "  set title {}\n{}  unset key\n  set xrange [*:*]; set yrange [*:*]\n"
      "  plot {}{}\n",
      literal(policy.condition), axis_labels(axis_title(across), axis_title(name)), goal, lines);
}

}  // namespace

std::vector<Plot> goal_plots(const std::string& study, const std::vector<LearntPolicy>& policies) {
  std::vector<std::string> names;
  for (const LearntPolicy& policy : policies) {
    for (const std::string& name : other_goals(policy)) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  std::vector<Plot> plots;
  for (const std::string& name : names) {
    std::vector<const LearntPolicy*> drawn;
    for (const LearntPolicy& policy : policies) {
      const auto own = other_goals(policy);
      if (std::find(own.begin(), own.end(), name) != own.end()) drawn.push_back(&policy);
    }
    const auto all = policy_pages(drawn);
    const std::string id = plots.empty() ? "goals" : fmt::format("goals_{}", plots.size() + 1);
    for (std::size_t page = 0; page < all.size(); ++page) {
      Plot plot{.title =
                    fmt::format("{} of {} before and after learning", axis_title(name), study)};
      name_page(id, page, all.size(), plot);
      PanelGrid grid{.rows = {},
                     .labels = {"best", "start", "", "", "", "", "", "", "goal"},
                     .panel_height_px = 320};
      DataSets data;
      for (const auto& row : all[page]) {
        grid.rows.emplace_back();
        for (const LearntPolicy* policy : row) {
          grid.rows.back().push_back(goal_panel(*policy, name, data));
        }
      }
      plot.data = data.take();
      arrange(grid, plot);
      plot.commands.insert(0, kStartAndGoalLines);
      plot.caption =
          "What the best roll-out of all repetitions came to, what learning began with "
          "(grey), and the task's goal (the thick light line).";
      plots.push_back(std::move(plot));
    }
  }
  return plots;
}

}  // namespace treeroll::report
