#include "learner/report/figures/policy_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "learner/report/figures/data_sets.h"

namespace treeroll::report {
namespace {

constexpr int kPanelHeightPx = 320;
constexpr int kPathHeightPx = 440;
constexpr int kLayersNamed = 2;

using Policies = std::vector<const LearntPolicy*>;

bool is_drawn(const LearntPolicy& policy) { return policy.start->input_dim() == 1; }

int dim(const LearntPolicy& policy) {
  return policy.start->input_dim() + policy.start->output_dim();
}

const Policy& after(const LearntPolicy& policy) {
  return policy.best ? *policy.best : *policy.start;
}

/// Names of the variables for the axes and, where the trace has one, the trace.
struct Names {
  const RolloutTrace* trace = nullptr;
  std::vector<std::string> columns;  ///< inputs, then outputs; empty: the task names none

  std::string title(Eigen::Index variable) const {
    if (!columns.empty()) return axis_title(columns[static_cast<std::size_t>(variable)]);
    return variable == 0 ? "input" : fmt::format("output {}", variable);
  }
};

Names names_of(const LearntPolicy& policy) {
  Names names;
  for (const auto* rollout : {&policy.best_rollout, &policy.start_rollout}) {
    if (!*rollout || names.trace != nullptr) continue;
    const RolloutTrace& trace = (*rollout)->trace;
    if (trace.policy_inputs.size() != static_cast<std::size_t>(policy.start->input_dim())) continue;
    if (trace.policy_outputs.size() != static_cast<std::size_t>(policy.start->output_dim())) {
      continue;
    }
    names.trace = &trace;
    names.columns = trace.policy_inputs;
    names.columns.insert(names.columns.end(), trace.policy_outputs.begin(),
                         trace.policy_outputs.end());
  }
  return names;
}

/// The goal below all else, where the task has one; the input has none, it is what it is.
std::string goal_line(const Names& names, Plane plane, DataSets& data) {
  if (names.trace == nullptr) return "";
  const auto wanted = [&](Eigen::Index variable) {
    const std::string& column = names.columns[static_cast<std::size_t>(variable)];
    return column_of(*names.trace, variable == 0 ? column : goal_of(column));
  };
  const auto across = wanted(plane.across);
  const auto up = wanted(plane.up);
  if (!across || !up) return "";
  return fmt::format("data index {} using 1:2 with lines lt 9 notitle, ",
                     add_curve("goal", *across, *up, data));
}

/// A path ends where the task ends it; beyond, the policy is nobody's path.
Range inputs_of_path(const PolicySketch& start, const Names& names) {
  if (names.trace != nullptr) {
    const std::vector<double> inputs = *column_of(*names.trace, names.columns.front());
    const auto [low, high] = std::minmax_element(inputs.begin(), inputs.end());
    if (!inputs.empty() && std::isfinite(*low) && *low < *high) return {*low, *high};
  }
  return {start.input_low, start.input_high};
}

/// One panel: goal, start, the layers after learning, what they come to.
std::string panel(const LearntPolicy& policy, Plane plane, bool is_path, DataSets& data) {
  const Names names = names_of(policy);
  const PolicySketch start = policy.start->sketch();
  const PolicySketch learnt = after(policy).sketch();
  const Range inputs =
      is_path ? inputs_of_path(start, names) : Range{start.input_low, start.input_high};
  std::string lines = goal_line(names, plane, data);
  lines += ellipses(start.layers.back(), plane, "lt 2 lw 1", data);
  lines += curve(start.layers.back(), plane, inputs, "lt 2", data) + ", ";
  for (int layer = 1; layer <= static_cast<int>(learnt.layers.size()); ++layer) {
    const std::string style = fmt::format("lt {} lw 1", std::min(layer, kLayersNamed + 1) + 2);
    lines += ellipses(learnt.layers[static_cast<std::size_t>(layer - 1)], plane, style, data);
  }
  lines += curve(learnt.layers.back(), plane, inputs, "lt 1", data);
  const std::string range =
      is_path ? "[*:*]; set size ratio -1" : fmt::format("[{}:{}]", inputs.low, inputs.high);
  return fmt::format(
      "  set title {}\n{}  unset key\n  set yrange [*:*]; set xrange {}\n  plot {}\n",
      literal(policy.condition), axis_labels(names.title(plane.across), names.title(plane.up)),
      range, lines);
}

std::vector<std::string> key(const Policies& policies, const Plane& plane) {
  std::vector<std::string> labels = {"learnt", "start"};
  int num_layers = 0;
  bool has_goal = false;
  for (const LearntPolicy* policy : policies) {
    DataSets unused;
    num_layers = std::max(num_layers, after(*policy).num_layers());
    has_goal = has_goal || !goal_line(names_of(*policy), plane, unused).empty();
  }
  for (int layer = 1; layer <= std::min(num_layers, kLayersNamed); ++layer) {
    labels.push_back(fmt::format("layer {}", layer));
  }
  if (num_layers > kLayersNamed) labels.emplace_back("further layers");
  if (has_goal) {
    labels.resize(8);  // the goal's line type is the ninth
    labels.emplace_back("goal");
  }
  return labels;
}

/// Pages of those policies that `draws` accepts.
template <class Predicate>
std::vector<Policies> policy_pages(const std::vector<LearntPolicy>& policies,
                                   const Predicate& draws) {
  Policies drawn;
  for (const LearntPolicy& policy : policies) {
    if (draws(policy)) drawn.push_back(&policy);
  }
  return pages_of(drawn, kPanelsPerPage);
}

constexpr const char* kLearntCaption =
    "of the best roll-out of all repetitions, with the Gaussians of each layer (ellipses of two "
    "standard deviations); in grey what learning began with.";
constexpr const char* kGoalCaption = " The thick light line is the task's goal.";

/// One kind of figure.
struct Figure {
  std::string id;
  std::string title;  ///< what it shows, and of which study
  Plane plane;
  bool is_path = false;  ///< one output over the other: as long as wide, and as the task ends it
  int panel_height_px = 0;
  std::string_view axes;  ///< begins the caption
};

/// A plot for each page, a panel for each policy.
void draw(const Figure& figure, const std::vector<Policies>& all, std::vector<Plot>& plots) {
  for (std::size_t page = 0; page < all.size(); ++page) {
    Plot plot{.title = figure.title};
    name_page(figure.id, page, all.size(), plot);
    PanelGrid grid{.commands = {},
                   .labels = key(all[page], figure.plane),
                   .panel_height_px = figure.panel_height_px};
    DataSets data;
    for (const LearntPolicy* policy : all[page]) {
      grid.commands.push_back(panel(*policy, figure.plane, figure.is_path, data));
    }
    plot.data = data.take();
    arrange(grid, plot);
    plot.commands.insert(0, kStartAndGoalLines);
    plot.caption = fmt::format("{} {}{}", figure.axes, kLearntCaption,
                               grid.labels.back() == "goal" ? kGoalCaption : "");
    plots.push_back(std::move(plot));
  }
}

}  // namespace

std::vector<Plot> policy_plots(const std::string& study,
                               const std::vector<LearntPolicy>& policies) {
  Eigen::Index outputs_max = 0;
  for (const LearntPolicy& policy : policies) {
    outputs_max = std::max<Eigen::Index>(outputs_max, policy.start->output_dim());
  }
  std::vector<Plot> plots;
  for (Eigen::Index output = 1; output <= outputs_max; ++output) {
    Figure figure{.id = output == 1 ? "policies" : fmt::format("policies_output_{}", output),
                  .title = "Policies of " + study + " before and after learning",
                  .plane = {.across = 0, .up = output},
                  .panel_height_px = kPanelHeightPx,
                  .axes = "Output over input"};
    if (outputs_max > 1) figure.title += fmt::format(", output {} of {}", output, outputs_max);
    const auto reaches = [&](const LearntPolicy& policy) {
      return is_drawn(policy) && dim(policy) > output;
    };
    draw(figure, policy_pages(policies, reaches), plots);
  }
  return plots;
}

std::vector<Plot> path_plots(const std::string& study, const std::vector<LearntPolicy>& policies) {
  const Figure figure{.id = "paths",
                      .title = "Paths of " + study + " before and after learning",
                      .plane = {.across = 1, .up = 2},
                      .is_path = true,
                      .panel_height_px = kPathHeightPx,
                      .axes = "One output over the other"};
  const auto is_path = [](const LearntPolicy& policy) {
    return is_drawn(policy) && dim(policy) == 3;
  };
  std::vector<Plot> plots;
  draw(figure, policy_pages(policies, is_path), plots);
  return plots;
}

std::vector<std::string> not_drawn(const std::vector<LearntPolicy>& policies) {
  std::vector<std::string> names;
  for (const LearntPolicy& policy : policies) {
    if (!is_drawn(policy)) names.push_back(policy.condition);
  }
  return names;
}

}  // namespace treeroll::report
