#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "learner/report/figures/policy_plot.h"
#include "learner/results/statistics.h"

namespace treeroll::report {
namespace {

constexpr int kSteps = 100;

constexpr const char* kSliceLines =
    "  set linetype 2 lc rgb '#888888' lw 2 dt (6,4)\n"
    "  set linetype 3 lc rgb '#56B4E9' lw 1 dt 1\n";

/// Where a policy is cut: each input over its range while the others stand at their centres.
struct Cut {
  std::vector<double> centres;
  std::vector<Range> ranges;
};

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> found;
  std::copy_if(values.begin(), values.end(), std::back_inserter(found),
               [](double value) { return std::isfinite(value); });
  return found;
}

/// Where the roll-out was: medians, and all of its way.
bool cut_by_trace(const RolloutTrace& trace, Cut& cut) {
  for (const std::string& name : trace.policy_inputs) {
    const std::vector<double> values = finite(*column_of(trace, name));
    if (values.empty()) return false;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    cut.centres.push_back(*median(values));
    cut.ranges.push_back({*low, *high});
  }
  return true;
}

/// Without a roll-out, where the start policy says that it acts.
Cut cut_by_policy(const Policy& policy) {
  Cut cut{.centres = {}, .ranges = policy.sketch().inputs};
  for (const Range& range : cut.ranges) cut.centres.push_back(std::midpoint(range.low, range.high));
  return cut;
}

Cut cut_of(const LearntPolicy& policy) {
  Cut cut;
  const RolloutTrace* trace = trace_of(policy);
  if (trace == nullptr || !cut_by_trace(*trace, cut)) cut = cut_by_policy(*policy.start);
  for (Range& range : cut.ranges) {
    if (!(range.low < range.high)) range = {range.low - .5, range.low + .5};
  }
  return cut;
}

std::string slice(const Policy& policy, const Cut& cut, Plane plane, const std::string& style,
                  DataSets& data) {
  data.begin("across up: slice");
  const PolicySketch sketch = policy.sketch();
  Controller& controller = *sketch.layers.back().controller;
  const auto input = static_cast<std::size_t>(plane.across);
  const auto input_dim = cut.centres.size();
  std::vector<double> all = cut.centres;
  all.resize(input_dim + static_cast<std::size_t>(policy.output_dim()));
  controller.start();
  for (int i = 0; i <= kSteps; ++i) {
    const Range& range = cut.ranges[input];
    all[input] = range.low + (range.high - range.low) * i / kSteps;
    controller.act(std::span(all).first(input_dim), std::span(all).subspan(input_dim));
    data.add(all[input], all[static_cast<std::size_t>(plane.up)]);
  }
  return fmt::format("data index {} using 1:2 with lines {} notitle", data.end(), style);
}

/// What the best roll-out came through, behind the slices: only there does a slice count.
std::string visits(const LearntPolicy& policy, Plane plane, DataSets& data) {
  const RolloutTrace* trace = trace_of(policy);
  if (trace == nullptr) return "";
  const std::vector<std::string> columns = traced_columns(policy);
  return fmt::format(
      "data index {} using 1:2 with lines lt 3 notitle, ",
      add_curve("the best roll-out",
                *column_of(*trace, columns[static_cast<std::size_t>(plane.across)]),
                *column_of(*trace, columns[static_cast<std::size_t>(plane.up)]), data));
}

std::string panel(const LearntPolicy& policy, Plane plane, DataSets& data) {
  const Cut cut = cut_of(policy);
  const Range& range = cut.ranges[static_cast<std::size_t>(plane.across)];
  std::string lines = visits(policy, plane, data);
  lines += slice(*policy.start, cut, plane, "lt 2", data) + ", ";
  lines += slice(after(policy), cut, plane, "lt 1", data);
  return fmt::format(
      "  set title {}\n{}  unset key\n  set xrange [{:.6g}:{:.6g}]; set yrange [*:*]\n"
      "  plot {}\n",
      literal(policy.condition), axes_of(policy, plane), range.low, range.high, lines);
}

}  // namespace

std::vector<Plot> slice_plots(const std::string& study, const std::vector<LearntPolicy>& policies) {
  int num_outputs = 0;
  for (const LearntPolicy& policy : policies) {
    if (policy.start->input_dim() > 1) {
      num_outputs = std::max(num_outputs, policy.start->output_dim());
    }
  }
  std::vector<Plot> plots;
  for (int output = 1; output <= num_outputs; ++output) {
    Rows<std::pair<const LearntPolicy*, Plane>> rows;
    bool has_visits = false;
    for (const LearntPolicy& policy : policies) {
      const int input_dim = policy.start->input_dim();
      if (input_dim == 1 || policy.start->output_dim() < output) continue;
      rows.emplace_back();
      for (int input = 0; input < input_dim; ++input) {
        rows.back().emplace_back(&policy, Plane{.across = input, .up = input_dim + output - 1});
      }
      has_visits = has_visits || trace_of(policy) != nullptr;
    }
    const auto pages = pages_of_rows(std::move(rows));
    for (std::size_t page = 0; page < pages.size(); ++page) {
      Plot plot{.title = "Slices of the policies of " + study + " before and after learning"};
      if (num_outputs > 1) plot.title += fmt::format(", output {} of {}", output, num_outputs);
      name_page(output_id("slices", output), page, pages.size(), plot);
      PanelGrid grid{.rows = {},
                     .labels = {"learnt", "start", has_visits ? "the best roll-out" : ""},
                     .panel_height_px = 320};
      DataSets data;
      for (const auto& row : pages[page]) {
        grid.rows.emplace_back();
        for (const auto& [policy, plane] : row) {
          grid.rows.back().push_back(panel(*policy, plane, data));
        }
      }
      plot.data = data.take();
      arrange(grid, plot);
      plot.commands.insert(0, kSliceLines);
      plot.caption = fmt::format(
          "Output over each input of the policy of the best roll-out of all repetitions, and of "
          "what learning began with (grey), while the other inputs stand {}.",
          has_visits ? "at the medians of what that roll-out came through; its own way is the thin "
                       "line"
                     : "in the middle of where the start acts");
      plots.push_back(std::move(plot));
    }
  }
  return plots;
}

}  // namespace treeroll::report
