#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "learner/report/figures/curves.h"
#include "learner/report/figures/study_plots.h"

namespace treeroll::report {
namespace {

/// What captions of curves say of their marks and points.
std::string details(const Rows<CurvePanel>& rows, std::size_t rollouts_per_point) {
  bool has_marks = false;
  for (const auto& row : rows) {
    for (const CurvePanel& panel : row) {
      for (const Curve& curve : panel.curves) has_marks = has_marks || !curve.switches.empty();
    }
  }
  return fmt::format(
      "{}{}",
      rollouts_per_point > 1
          ? fmt::format(" A point is a mean over {} roll-outs.", rollouts_per_point)
          : "",
      has_marks ? " Circles: the median roll-out at which a layer was left, over the runs that "
                  "left it."
                : "");
}

/// A panel a group, with what `curve_of` makes of each condition.
template <class CurveOf>
Rows<CurvePanel> panels_of(const StudyResults& study, const Rows<ConditionGroup>& groups,
                           const CurveOf& curve_of) {
  Rows<CurvePanel> rows;
  for (const auto& row : groups) {
    rows.emplace_back();
    for (const ConditionGroup& group : row) {
      CurvePanel& panel = rows.back().emplace_back();
      panel.title = group.name.empty() ? study.name : group.name;
      for (std::size_t c = 0; c < group.conditions.size(); ++c) {
        panel.curves.push_back(curve_of(group.conditions[c]));
        panel.curves.back().label = group.labels[c];
      }
    }
  }
  return rows;
}

}  // namespace

Plot learning_curves(const StudyResults& study, const Rows<ConditionGroup>& groups) {
  std::size_t num_runs = 0;
  const auto rows = panels_of(study, groups, [&](const std::string& condition) {
    const auto runs = runs_of(study, condition);
    num_runs = std::max(num_runs, runs.size());
    Curve curve{.label = {}, .repetitions = {}, .switches = median_switches(runs)};
    for (const MeasuredRun& run : runs) {
      std::vector<double>& rewards = curve.repetitions.emplace_back();
      for (int i = 0; i < run.num_rollouts(); ++i) {
        rewards.push_back(run.reward(i).value_or(std::numeric_limits<double>::quiet_NaN()));
      }
    }
    return curve;
  });
  Plot plot{.id = "learning_curves", .title = "Learning curves of " + study.name};
  const std::size_t width = draw_curves(rows, {.title = "reward"}, plot);
  plot.caption = fmt::format(
      "Reward of the (perturbed) roll-outs, mean over up to {} repetitions; the bands are 95 % "
      "intervals of the mean.{}{}",
      num_runs, caption_of_runs_that_go_on(study), details(rows, width));
  return plot;
}

Plot noise_growth(const StudyResults& study, const Rows<ConditionGroup>& groups,
                  const NoiseLevels& noise) {
  std::size_t num_runs = 0;
  const auto rows = panels_of(study, groups, [&](const std::string& condition) {
    Curve curve;
    const auto found = noise.find(condition);
    if (found == noise.end()) return curve;
    curve.repetitions = found->second;
    num_runs = std::max(num_runs, curve.repetitions.size());
    auto runs = runs_of(study, condition);
    const auto num_drawn = std::min(runs.size(), curve.repetitions.size());
    runs.erase(runs.begin() + static_cast<std::ptrdiff_t>(num_drawn), runs.end());
    curve.switches = median_switches(runs);
    return curve;
  });
  if (num_runs == 0) return {};
  Plot plot{.id = "noise_growth", .title = "Exploration noise of " + study.name};
  const std::size_t width =
      draw_curves(rows, {.title = "noise / noise deviations", .is_logarithmic = true}, plot);
  plot.caption = fmt::format(
      "Exploration noise after each roll-out: root of the mean variance over the elements of "
      "theta, "
      "each in units of its noise deviation (1 is gamma = 1). Geometric mean over the first {} "
      "repetitions with its 95 % interval.{}",
      num_runs, details(rows, width));
  return plot;
}

}  // namespace treeroll::report
