#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "learner/report/figures/study_plots.h"
#include "learner/report/statistics/comparison.h"
#include "learner/report/statistics/sample.h"

namespace treeroll::report {
namespace {

constexpr std::size_t kConditionsMax = 4;
/// Beyond it the axis ends: p = 1e-8.
constexpr double kEvidenceMax = 8;

/// -log10 p where the first is ahead, log10 (1 - p) where the second is.
double evidence(double p) {
  const double tail = std::max(std::min(p, 1 - p), std::pow(10., -kEvidenceMax));
  return p < .5 ? -std::log10(tail) : std::log10(tail);
}

/// p over roll-outs of every pair of a group.
struct PValuePanel {
  std::string title;
  std::vector<std::string> labels;
  std::vector<std::vector<double>> p;  ///< by pair
};

PValuePanel panel_of(const StudyResults& study, const ConditionGroup& group) {
  PValuePanel panel{.title = group.name.empty() ? study.name : group.name, .labels = {}, .p = {}};
  for (std::size_t a = 0; a < group.conditions.size(); ++a) {
    for (std::size_t b = a + 1; b < group.conditions.size(); ++b) {
      panel.labels.push_back(group.labels[a] + " over " + group.labels[b]);
      panel.p.push_back(compare(group.labels[a], runs_of(study, group.conditions[a]),
                                group.labels[b], runs_of(study, group.conditions[b]), false)
                            .p);
    }
  }
  return panel;
}

Plot p_value_page(const std::vector<PValuePanel>& panels) {
  std::size_t length = 0;
  for (const PValuePanel& panel : panels) {
    for (const auto& p : panel.p) length = std::max(length, p.size());
  }
  const bool same_labels = std::all_of(panels.begin(), panels.end(), [&](const PValuePanel& panel) {
    return panel.labels == panels.front().labels;
  });
  PanelGrid grid{.commands = {}, .labels = {}, .panel_height_px = 340};
  if (same_labels) grid.labels = panels.front().labels;
  Plot plot;
  std::size_t index = 0;
  for (const PValuePanel& panel : panels) {
    std::string lines;
    for (std::size_t pair = 0; pair < panel.p.size(); ++pair, ++index) {
      plot.data += "# rollout p evidence\n";
      for (std::size_t i = 0; i < panel.p[pair].size(); ++i) {
        const double p = panel.p[pair][i];
        plot.data += fmt::format("{} {} {}\n", i + 1, datum(p), datum(evidence(p)));
      }
      plot.data += "\n\n";
      lines += fmt::format("{}data index {} using 1:3 with lines lt {} lw 1 title {}",
                           pair == 0 ? "" : ", ", index, pair + 1, literal(panel.labels[pair]));
    }
    grid.commands.push_back(fmt::format(
        "  {}; set xtics {}\n  set title {}\n  set xlabel 'roll-out'; set ylabel 'p, one-sided'\n"
        "  set yrange [-8.3:8.3]; set xrange [0:*]\n"
        "  set ytics ('1e-8' -8, '1e-5' -5, '.001' -3, '.05' -1.30103, '.5' -.30103, '' .30103, "
        "'.05' 1.30103, '.001' 3, '1e-5' 5, '1e-8' 8)\n"
        "  set arrow 1 from graph 0, first 1.30103 to graph 1, first 1.30103 nohead lc rgb "
        "'#888888'\n"
        "  set arrow 2 from graph 0, first -1.30103 to graph 1, first -1.30103 nohead lc rgb "
        "'#888888'\n"
        "  set label 1 'first ahead' at graph .99, graph .96 right\n"
        "  set label 2 'second ahead' at graph .99, graph .04 right\n"
        "  plot {}\n",
        same_labels ? "unset key" : "set key above horizontal Left reverse samplen 4",
        std::max<std::size_t>(length / 4, 1), literal(panel.title), lines));
  }
  arrange(grid, plot);
  plot.caption =
      "p of Welch's one-sided t-test at each roll-out, not corrected for their number: upwards "
      "where the first condition named has the higher mean, downwards where the second has. The "
      "grey lines are at .05.";
  return plot;
}

}  // namespace

Figures p_values(const StudyResults& study, const std::vector<ConditionGroup>& groups) {
  std::vector<PValuePanel> panels;
  std::vector<std::string> too_many;
  std::vector<std::string> too_few_runs;
  for (const ConditionGroup& group : groups) {
    if (group.conditions.size() < 2) continue;
    const std::string name = group.name.empty() ? listed(group.labels) : group.name;
    if (group.conditions.size() > kConditionsMax) {
      too_many.push_back(name);
    } else if (std::any_of(
                   group.conditions.begin(), group.conditions.end(),
                   [&](const auto& condition) { return runs_of(study, condition).size() < 2; })) {
      too_few_runs.push_back(name);
    } else {
      panels.push_back(panel_of(study, group));
    }
  }
  Figures figures{.plots = {}};
  const auto pages = pages_of(panels, kPanelsPerPage);
  for (std::size_t page = 0; page < pages.size(); ++page) {
    Plot plot = p_value_page(pages[page]);
    plot.title = "Which condition is ahead in " + study.name;
    name_page("p_values", page, pages.size(), plot);
    figures.plots.push_back(std::move(plot));
  }
  if (!too_many.empty()) {
    figures.left_out.push_back(fmt::format(
        "p over roll-outs is not drawn where more than {} conditions are to be compared "
        "pair by pair: {}.",
        kConditionsMax, listed(too_many)));
  }
  if (!too_few_runs.empty()) {
    figures.left_out.push_back("p over roll-outs is not drawn where a condition has one run: " +
                               listed(too_few_runs) + ".");
  }
  return figures;
}

}  // namespace treeroll::report
