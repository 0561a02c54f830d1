#include "learner/report/figures/policy_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace treeroll::report {
namespace {

constexpr int kPanelHeightPx = 320;
constexpr int kPathHeightPx = 440;

Plot page_of(const PolicyRows& rows, const PolicyFigure& figure, const View& view) {
  DataSets data;
  Rows<std::string> lines;
  bool has_goal = false;
  for (const auto& row : rows) {
    lines.emplace_back();
    for (const LearntPolicy* policy : row) {
      const std::string goal = goal_line(*policy, view.plane, figure.goal_style(), data);
      has_goal = has_goal || !goal.empty();
      lines.back().push_back(figure.lines(*policy, view, goal, data));
    }
  }
  PanelGrid grid{.rows = {},
                 .labels = figure.labels(rows, has_goal),
                 .panel_height_px = view.is_path ? kPathHeightPx : kPanelHeightPx};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    grid.rows.emplace_back();
    for (std::size_t j = 0; j < rows[i].size(); ++j) {
      const LearntPolicy& policy = *rows[i][j];
      grid.rows.back().push_back(fmt::format(
          "  set title {}\n{}  unset key\n{}  plot {}\n", literal(figure.panel_title(policy)),
          axes_of(policy, view.plane),
          view.is_path
              ? equal_axes(data.box())
              : fmt::format("  set yrange [*:*]; set xrange {}\n", figure.input_range(policy)),
          lines[i][j]));
    }
  }
  Plot plot;
  plot.data = data.take();
  arrange(grid, plot);
  plot.commands.insert(0, figure.line_types());
  plot.caption = figure.caption(rows, view, has_goal);
  return plot;
}

void add_pages(const std::vector<const LearntPolicy*>& policies, const PolicyFigure& figure,
               const View& view, const std::string& id, const std::string& title,
               std::vector<Plot>& plots) {
  const auto all = policy_pages(policies);
  for (std::size_t page = 0; page < all.size(); ++page) {
    plots.push_back(page_of(all[page], figure, view));
    plots.back().title = title;
    name_page(id, page, all.size(), plots.back());
  }
}

}  // namespace

std::vector<Plot> draw_outputs(const std::vector<LearntPolicy>& policies,
                               const PolicyFigure& figure, const std::string& id,
                               const std::string& title) {
  int num_outputs = 0;
  for (const LearntPolicy& policy : policies) {
    if (policy.start->input_dim() != 1) continue;
    num_outputs = std::max(num_outputs, policy.start->output_dim());
  }
  std::vector<Plot> plots;
  for (int output = 1; output <= num_outputs; ++output) {
    std::vector<const LearntPolicy*> drawn;
    for (const LearntPolicy& policy : policies) {
      if (policy.start->input_dim() == 1 && policy.start->output_dim() >= output) {
        drawn.push_back(&policy);
      }
    }
    add_pages(
        drawn, figure, {.plane = {.across = 0, .up = output}}, output_id(id, output),
        num_outputs == 1 ? title : fmt::format("{}, output {} of {}", title, output, num_outputs),
        plots);
  }
  return plots;
}

std::vector<Plot> draw_paths(const std::vector<LearntPolicy>& policies, const PolicyFigure& figure,
                             const std::string& id, const std::string& title) {
  std::vector<const LearntPolicy*> drawn;
  for (const LearntPolicy& policy : policies) {
    if (policy.start->input_dim() == 1 && policy.start->output_dim() == 2) drawn.push_back(&policy);
  }
  std::vector<Plot> plots;
  add_pages(drawn, figure, {.plane = {.across = 1, .up = 2}, .is_path = true}, id, title, plots);
  return plots;
}

}  // namespace treeroll::report
