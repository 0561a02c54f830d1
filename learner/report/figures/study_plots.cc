#include "learner/report/figures/study_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "learner/report/statistics/sample.h"

namespace treeroll::report {
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

Figures study_plots(const StudyResults& study, const NoiseLevels& noise) {
  const std::vector<std::string> conditions = conditions_of(study);
  Figures figures{.plots = {}};
  if (conditions.empty()) return figures;
  std::vector<Plot>& plots = figures.plots;
  const auto by_last = pages(conditions, 1);
  for (std::size_t page = 0; page < by_last.size(); ++page) {
    plots.push_back(learning_curves(study, by_last[page]));
    name_page("learning_curves", page, by_last.size(), plots.back());
  }
  const auto by_other = group(conditions, 2);
  if (by_other.size() > 1 && by_other.front().conditions.size() > 1 && is_readable(by_other)) {
    plots.push_back(learning_curves(study, by_other));
    plots.back().id += "_across";
  }
  Figures tests = p_values(study, group(conditions, 1));
  std::move(tests.plots.begin(), tests.plots.end(), std::back_inserter(plots));
  figures.left_out = std::move(tests.left_out);
  if (Plot boxes = switch_boxes(study); !boxes.commands.empty()) plots.push_back(std::move(boxes));
  for (std::size_t page = 0; page < by_last.size(); ++page) {
    Plot plot = noise_growth(study, by_last[page], noise);
    if (plot.commands.empty()) continue;
    name_page("noise_growth", page, by_last.size(), plot);
    plots.push_back(std::move(plot));
  }
  return figures;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 6;
  const std::size_t num_named = names.size() <= kNamed + 1 ? names.size() : kNamed;
  std::string text;
  for (std::size_t i = 0; i < num_named; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (num_named < names.size()) text += fmt::format(" and {} more", names.size() - num_named);
  return text;
}

}  // namespace treeroll::report
