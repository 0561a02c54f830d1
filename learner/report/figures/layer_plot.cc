#include "learner/report/figures/layer_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "learner/report/figures/data_sets.h"
#include "learner/report/figures/learnt_policy.h"

namespace treeroll::report {
namespace {

/// More samples than these a panel does not show.
constexpr Eigen::Index kSamplesMax = 500;

struct Panel {
  const StartModel* start = nullptr;
  int layer = 1;
  Eigen::Index output = 1;  ///< from 1: its place after the input
};

std::string axis(const StartModel& start, Eigen::Index variable) {
  return variable_title(start.columns, start.policy->input_dim(), variable);
}

std::string title(const Panel& panel) {
  const std::vector<std::string>& names = panel.start->conditions;
  std::string title = names.front();
  if (names.size() > 1) title += fmt::format(" and {} more", names.size() - 1);
  if (panel.start->policy->num_layers() > 1) title += fmt::format(", layer {}", panel.layer);
  if (panel.start->policy->output_dim() > 1) title += fmt::format(", output {}", panel.output);
  return title;
}

std::string add_samples(const Eigen::MatrixXd& samples, Plane plane, DataSets& data) {
  data.begin("across up: demonstration");
  const Eigen::Index num_shown = std::min(samples.cols(), kSamplesMax);
  for (Eigen::Index i = 0; i < num_shown; ++i) {
    const Eigen::Index sample = i * samples.cols() / num_shown;
    if (std::isnan(samples(plane.up, sample))) continue;  // an output that the sample lacks
    data.add(samples(plane.across, sample), samples(plane.up, sample));
  }
  return fmt::format("data index {} using 1:2 with points pt 7 ps .4 lc rgb '#999999' notitle, ",
                     data.end());
}

std::string commands(const Panel& panel, DataSets& data) {
  const StartModel& start = *panel.start;
  const Plane plane{.across = 0, .up = panel.output};
  const PolicySketch sketch = start.policy->sketch();
  const auto layer = static_cast<std::size_t>(panel.layer - 1);
  const Range inputs = sketch.inputs.front();
  data.begin_box();
  std::string lines = start.demonstration ? add_samples(*start.demonstration, plane, data) : "";
  lines += ellipses(sketch.layers[layer], plane, "lt 2 lw 1", data);
  lines += curve(sketch.layers[layer], plane, inputs, "lt 1", data);
  std::string heading = literal(title(panel));
  if (layer < start.log_likelihoods.size()) {
    heading += fmt::format(".\"\\n\".'log-likelihood {:.4f}'", start.log_likelihoods[layer]);
  }
  return fmt::format(
      "  set title {}\n{}  unset key\n  set xrange [{}:{}]; set yrange {}\n"
      "  plot {}\n",
      heading, axis_labels(axis(start, 0), axis(start, panel.output)), inputs.low, inputs.high,
      axis_range(data.box().up), lines);
}

}  // namespace

std::vector<Plot> layer_plots(const std::string& study, const std::vector<StartModel>& starts) {
  Rows<Panel> panels;  // a row an output of a start
  bool has_samples = false;
  bool are_mixtures = false;
  for (const StartModel& start : starts) {
    if (start.policy->input_dim() != 1) continue;
    has_samples = has_samples || start.demonstration;
    are_mixtures = are_mixtures || has_gaussians(start.policy->sketch());
    for (Eigen::Index output = 1; output <= start.policy->output_dim(); ++output) {
      panels.emplace_back();
      for (int layer = 1; layer <= start.policy->num_layers(); ++layer) {
        panels.back().push_back({.start = &start, .layer = layer, .output = output});
      }
    }
  }
  const auto pages = pages_of_rows(std::move(panels));
  std::vector<Plot> plots;
  for (std::size_t page = 0; page < pages.size(); ++page) {
    Plot plot{.title = "What learning began with in " + study + ", layer by layer"};
    name_page("layers", page, pages.size(), plot);
    PanelGrid grid{.rows = {}, .labels = {"policy"}, .panel_height_px = 340};
    if (are_mixtures) grid.labels = {"regression", "Gaussians"};
    DataSets data;
    for (const auto& row : pages[page]) {
      grid.rows.emplace_back();
      for (const Panel& panel : row) grid.rows.back().push_back(commands(panel, data));
    }
    plot.data = data.take();
    arrange(grid, plot);
    plot.caption = fmt::format(
        "The start policies of the conditions: output over input of each layer{}.{}{}",
        are_mixtures ? ", and its Gaussians (ellipses of two standard deviations)" : "",
        has_samples ? " Points are the demonstration." : "",
        has_samples && are_mixtures ? " Log-likelihoods are means over its samples." : "");
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace treeroll::report
