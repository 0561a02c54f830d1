#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "learner/figures/study_plots.h"
#include "learner/report/comparison.h"
#include "learner/report/sample.h"

namespace treeroll {
namespace {

constexpr std::size_t kConditionsMax = 4;
constexpr std::size_t kPanelsMax = 12;
/// Beyond it the axis ends: p = 1e-8.
constexpr double kEvidenceMax = 8;

/// -log10 p where the first is ahead, log10 (1 - p) where the second is.
double evidence(double p) {
  const double tail = std::max(std::min(p, 1 - p), std::pow(10., -kEvidenceMax));
  return p < .5 ? -std::log10(tail) : std::log10(tail);
}

}  // namespace

Plot p_values(const StudyResults& study, const std::vector<ConditionGroup>& groups) {
  Plot plot{.id = "p_values", .title = "Which condition is ahead in " + study.name};
  PanelGrid grid{.commands = {}, .labels = {}, .panel_height_px = 340};
  std::vector<std::vector<std::string>> labels;  // by panel
  std::size_t index = 0;
  std::size_t length = 0;
  for (const ConditionGroup& group : groups) {
    if (group.conditions.size() < 2 || group.conditions.size() > kConditionsMax) continue;
    if (grid.commands.size() == kPanelsMax) break;
    std::string lines;
    labels.emplace_back();
    for (std::size_t a = 0; a < group.conditions.size(); ++a) {
      for (std::size_t b = a + 1; b < group.conditions.size(); ++b, ++index) {
        const auto runs_a = runs_of(study, group.conditions[a]);
        const auto runs_b = runs_of(study, group.conditions[b]);
        if (runs_a.size() < 2 || runs_b.size() < 2) return {};
        const Comparison comparison =
            compare(group.labels[a], runs_a, group.labels[b], runs_b, false);
        plot.data += "# rollout p evidence\n";
        for (std::size_t i = 0; i < comparison.p.size(); ++i) {
          plot.data += fmt::format("{} {} {}\n", i + 1, datum(comparison.p[i]),
                                   datum(evidence(comparison.p[i])));
        }
        plot.data += "\n\n";
        length = std::max(length, comparison.p.size());
        labels.back().push_back(group.labels[a] + " over " + group.labels[b]);
        lines += fmt::format("{}data index {} using 1:3 with lines lt {} lw 1 title {}",
                             lines.empty() ? "" : ", ", index, labels.back().size(),
                             literal(labels.back().back()));
      }
    }
    grid.commands.push_back(fmt::format(
        "  set title {}\n  set xlabel 'roll-out'; set ylabel 'p, one-sided'\n"
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
        literal(group.name.empty() ? study.name : group.name), lines));
  }
  if (grid.commands.empty()) return {};
  const bool same = std::all_of(labels.begin(), labels.end(),
                                [&](const auto& of_panel) { return of_panel == labels.front(); });
  if (same) grid.labels = labels.front();
  for (std::string& panel : grid.commands) {
    panel = fmt::format("  {}; set xtics {}\n",
                        same ? "unset key" : "set key above horizontal Left reverse samplen 4",
                        std::max<std::size_t>(length / 4, 1)) +
            panel;
  }
  arrange(grid, plot);
  plot.caption =
      "p of Welch's one-sided t-test at each roll-out, not corrected for their number: upwards "
      "where the first condition named has the higher mean, downwards where the second has. The "
      "grey lines are at .05.";
  return plot;
}

}  // namespace treeroll
