#include "learner/figures/study_plots.h"

#include <algorithm>
#include <utility>

#include "learner/report/sample.h"

namespace treeroll {
namespace {

constexpr std::size_t kPanelsMax = 15;
constexpr std::size_t kCurvesMax = 8;

bool is_readable(const std::vector<ConditionGroup>& groups) {
  return groups.size() <= kPanelsMax &&
         std::all_of(groups.begin(), groups.end(), [](const ConditionGroup& group) {
           return group.conditions.size() <= kCurvesMax;
         });
}

/// More than a page: parts of it.
std::vector<std::vector<ConditionGroup>> pages(const std::vector<std::string>& conditions,
                                               std::size_t place) {
  std::vector<std::vector<ConditionGroup>> all;
  for (ConditionGroup& whole : group(conditions, place)) {
    for (std::size_t first = 0; first < whole.conditions.size(); first += kCurvesMax) {
      const std::size_t last = std::min(first + kCurvesMax, whole.conditions.size());
      if (all.empty() || all.back().size() == kPanelsMax) all.emplace_back();
      all.back().push_back({whole.name,
                            {whole.conditions.begin() + static_cast<std::ptrdiff_t>(first),
                             whole.conditions.begin() + static_cast<std::ptrdiff_t>(last)},
                            {whole.labels.begin() + static_cast<std::ptrdiff_t>(first),
                             whole.labels.begin() + static_cast<std::ptrdiff_t>(last)}});
    }
  }
  return all;
}

}  // namespace

std::vector<Plot> study_plots(const StudyResults& study) {
  const std::vector<std::string> conditions = conditions_of(study);
  std::vector<Plot> plots;
  if (conditions.empty()) return plots;
  for (const auto& page : pages(conditions, 1)) {
    Plot plot = learning_curves(study, page);
    if (!plots.empty()) plot.id += "_" + std::to_string(plots.size() + 1);
    plots.push_back(std::move(plot));
  }
  const auto by_other = group(conditions, 2);
  if (by_other.size() > 1 && by_other.front().conditions.size() > 1 && is_readable(by_other)) {
    Plot plot = learning_curves(study, by_other);
    plot.id += "_across";
    plots.push_back(std::move(plot));
  }
  for (Plot& plot : std::vector{p_values(study, group(conditions, 1)), switch_boxes(study)}) {
    if (!plot.commands.empty()) plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace treeroll
