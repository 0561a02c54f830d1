#include "learner/report/figures/study_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "learner/report/statistics/sample.h"

namespace treeroll::report {
namespace {

constexpr std::size_t kCurvesMax = 8;

/// Groups of curves by page; a group of more than can be told apart stands in several panels.
std::vector<Rows<ConditionGroup>> pages(const std::vector<std::string>& conditions,
                                        std::size_t place) {
  std::vector<ConditionGroup> parts;
  for (const ConditionGroup& whole : group(conditions, place)) {
    const auto names = pages_of(whole.conditions, kCurvesMax);
    const auto labels = pages_of(whole.labels, kCurvesMax);
    for (std::size_t i = 0; i < names.size(); ++i) {
      parts.push_back({whole.name, whole.row, names[i], labels[i]});
    }
  }
  return pages_of_rows(rows_by(parts, [](const ConditionGroup& part) { return part.row; }));
}

/// Whether the part at this place sets conditions against each other.
bool varies(const std::vector<std::string>& conditions, std::size_t place) {
  const auto groups = group(conditions, place);
  return std::any_of(groups.begin(), groups.end(),
                     [](const ConditionGroup& group) { return group.conditions.size() > 1; });
}

}  // namespace

Figures study_plots(const StudyResults& study, const NoiseLevels& noise) {
  const std::vector<std::string> conditions = conditions_of(study);
  Figures figures{.plots = {}};
  if (conditions.empty()) return figures;
  std::vector<Plot>& plots = figures.plots;
  const auto by_last = pages(conditions, 1);
  const auto add_curves = [&](const std::string& id, const auto& all) {
    for (std::size_t page = 0; page < all.size(); ++page) {
      plots.push_back(learning_curves(study, all[page]));
      name_page(id, page, all.size(), plots.back());
    }
  };
  add_curves("learning_curves", by_last);
  if (num_places(conditions) > 1 && varies(conditions, 2)) {
    add_curves("learning_curves_across", pages(conditions, 2));
  }
  Plot averages = average_rewards(study);
  if (!averages.id.empty()) plots.push_back(std::move(averages));
  for (std::size_t place = 1; place <= num_places(conditions); ++place) {
    Figures tests = p_values(study, place);
    std::move(tests.plots.begin(), tests.plots.end(), std::back_inserter(plots));
    std::move(tests.left_out.begin(), tests.left_out.end(), std::back_inserter(figures.left_out));
  }
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
