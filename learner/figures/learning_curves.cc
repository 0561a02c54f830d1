#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "learner/figures/study_plots.h"
#include "learner/report/run_counts.h"
#include "learner/report/sample.h"
#include "learner/report/statistics.h"

namespace treeroll {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// More points than these a line does not show.
constexpr std::size_t kPointsMax = 200;

struct Point {
  double rollout = 0;  ///< from 1
  double mean = kNone;
  double low = kNone;
  double high = kNone;
};

std::size_t longest(const std::vector<const RunRecord*>& runs) {
  std::size_t length = 0;
  for (const RunRecord* run : runs) length = std::max(length, run->rollouts.size());
  return length;
}

/// Over repetitions, each with its mean over `width` roll-outs from `first` on.
Point point(const std::vector<const RunRecord*>& runs, std::size_t first, std::size_t width) {
  std::vector<double> values;
  for (const RunRecord* run : runs) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = first; i < std::min(first + width, run->rollouts.size()); ++i) {
      if (!is_applied(run->rollouts[i])) continue;
      sum += run->rollouts[i].reward;
      ++count;
    }
    if (count > 0) values.push_back(sum / count);
  }
  Point found{.rollout = static_cast<double>(first) + 1 + static_cast<double>(width - 1) / 2};
  if (!values.empty()) found.mean = *mean(values);
  if (const auto interval = mean_interval_95(values)) {
    found.low = interval->low;
    found.high = interval->high;
  }
  return found;
}

}  // namespace

Plot learning_curves(const StudyResults& study, const std::vector<ConditionGroup>& groups) {
  std::size_t length = 1;
  std::size_t num_runs = 0;
  for (const ConditionGroup& group : groups) {
    for (const std::string& condition : group.conditions) {
      length = std::max(length, longest(runs_of(study, condition)));
      num_runs = std::max(num_runs, runs_of(study, condition).size());
    }
  }
  const std::size_t width = (length + kPointsMax - 1) / kPointsMax;

  Plot plot{.id = "learning_curves", .title = "Learning curves of " + study.name};
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  std::vector<std::string> curves;  // by panel
  std::size_t index = 0;
  for (const ConditionGroup& group : groups) {
    std::string bands;
    std::string lines;
    for (std::size_t c = 0; c < group.conditions.size(); ++c, ++index) {
      const auto runs = runs_of(study, group.conditions[c]);
      plot.data += "# rollout mean low high\n";
      for (std::size_t first = 0; first < std::max<std::size_t>(longest(runs), 1); first += width) {
        const Point p = point(runs, first, width);
        plot.data +=
            fmt::format("{} {} {} {}\n", p.rollout, datum(p.mean), datum(p.low), datum(p.high));
        for (const double value : {p.mean, p.low, p.high}) {
          if (!std::isfinite(value)) continue;
          lowest = std::min(lowest, value);
          highest = std::max(highest, value);
        }
      }
      plot.data += "\n\n";
      bands += fmt::format(
          "data index {} using 1:3:4 with filledcurves lt {} fs transparent "
          "solid .15 notitle, ",
          index, c + 1);
      lines += fmt::format("{}data index {} using 1:2 with lines lt {} title {}",
                           c == 0 ? "" : ", ", index, c + 1, literal(group.labels[c]));
    }
    curves.push_back(bands + lines);
  }
  if (!(lowest < highest)) {  // one value, or none
    lowest = std::isfinite(lowest) ? lowest - .5 : 0;
    highest = lowest + 1;
  }
  const double margin = .03 * (highest - lowest);

  const bool same_labels =
      groups.size() > 1 && std::all_of(groups.begin(), groups.end(), [&](const auto& group) {
        return group.labels == groups.front().labels;
      });
  PanelGrid grid;
  if (same_labels || groups.size() == 1) grid.labels = groups.front().labels;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    grid.commands.push_back(fmt::format(
        "  set title {}\n  set xlabel 'roll-out'; set ylabel 'reward'\n"
        "  set xrange [0:{}]; set xtics {}\n  set yrange [{}:{}]\n"
        "  {}\n  plot {}\n",
        literal(groups[g].name.empty() ? study.name : groups[g].name), length,
        std::max<std::size_t>(length / 4, 1), lowest - margin, highest + margin,
        grid.labels.empty() ? "set key above horizontal Left reverse samplen 4" : "unset key",
        curves[g]));
  }
  arrange(grid, plot);
  plot.caption = fmt::format(
      "Reward of the (perturbed) roll-outs, mean over up to {} repetitions{}; the bands are 95 % "
      "intervals of the mean.",
      num_runs, width > 1 ? fmt::format(" and over {} roll-outs a point", width) : "");
  return plot;
}

}  // namespace treeroll
