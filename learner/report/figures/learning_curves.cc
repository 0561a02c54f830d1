#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "learner/report/figures/curves.h"
#include "learner/report/figures/study_plots.h"
#include "learner/results/run_counts.h"

namespace treeroll::report {
namespace {

/// What captions of curves say of their marks and points.
std::string details(const std::vector<CurvePanel>& panels, std::size_t rollouts_per_point) {
  const bool has_marks = std::any_of(panels.begin(), panels.end(), [](const CurvePanel& panel) {
    return std::any_of(panel.curves.begin(), panel.curves.end(),
                       [](const Curve& curve) { return !curve.switches.empty(); });
  });
  return fmt::format(
      "{}{}",
      rollouts_per_point > 1
          ? fmt::format(" A point is a mean over {} roll-outs.", rollouts_per_point)
          : "",
      has_marks ? " Circles: the median roll-out at which a layer was left, over the runs that "
                  "left it."
                : "");
}

std::string title_of(const StudyResults& study, const ConditionGroup& group) {
  return group.name.empty() ? study.name : group.name;
}

}  // namespace

Plot learning_curves(const StudyResults& study, const std::vector<ConditionGroup>& groups) {
  std::vector<CurvePanel> panels;
  std::size_t num_runs = 0;
  for (const ConditionGroup& group : groups) {
    CurvePanel panel{.title = title_of(study, group), .curves = {}};
    for (std::size_t c = 0; c < group.conditions.size(); ++c) {
      const auto runs = runs_of(study, group.conditions[c]);
      num_runs = std::max(num_runs, runs.size());
      Curve curve{.label = group.labels[c], .repetitions = {}, .switches = median_switches(runs)};
      for (const RunRecord* run : runs) {
        curve.repetitions.emplace_back();
        for (const RolloutRecord& rollout : run->rollouts) {
          curve.repetitions.back().push_back(
              is_applied(rollout) ? rollout.reward : std::numeric_limits<double>::quiet_NaN());
        }
      }
      panel.curves.push_back(std::move(curve));
    }
    panels.push_back(std::move(panel));
  }
  Plot plot{.id = "learning_curves", .title = "Learning curves of " + study.name};
  const std::size_t width = draw_curves(panels, {.title = "reward"}, plot);
  plot.caption = fmt::format(
      "Reward of the (perturbed) roll-outs, mean over up to {} repetitions; the bands are 95 % "
      "intervals of the mean.{}",
      num_runs, details(panels, width));
  return plot;
}

Plot noise_growth(const StudyResults& study, const std::vector<ConditionGroup>& groups,
                  const NoiseLevels& noise) {
  std::vector<CurvePanel> panels;
  std::size_t num_runs = 0;
  for (const ConditionGroup& group : groups) {
    CurvePanel panel{.title = title_of(study, group), .curves = {}};
    for (std::size_t c = 0; c < group.conditions.size(); ++c) {
      const auto found = noise.find(group.conditions[c]);
      Curve curve{.label = group.labels[c], .repetitions = {}};
      if (found != noise.end()) {
        curve.repetitions = found->second;
        auto runs = runs_of(study, group.conditions[c]);
        runs.resize(std::min(runs.size(), curve.repetitions.size()));
        curve.switches = median_switches(runs);
      }
      num_runs = std::max(num_runs, curve.repetitions.size());
      panel.curves.push_back(std::move(curve));
    }
    panels.push_back(std::move(panel));
  }
  if (num_runs == 0) return {};
  Plot plot{.id = "noise_growth", .title = "Exploration noise of " + study.name};
  const std::size_t width =
      draw_curves(panels, {.title = "noise / noise deviations", .is_logarithmic = true}, plot);
  plot.caption = fmt::format(
      "Exploration noise after each roll-out: root of the mean variance over the elements of "
      "theta, "
      "each in units of its noise deviation (1 is gamma = 1). Geometric mean over the first {} "
      "repetitions with its 95 % interval.{}",
      num_runs, details(panels, width));
  return plot;
}

}  // namespace treeroll::report
