#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

#include "learner/report/figures/study_plots.h"
#include "learner/report/statistics/comparison.h"
#include "learner/report/statistics/sample.h"

namespace treeroll::report {
namespace {

/// All pairs of so many conditions are told apart in one panel.
constexpr std::size_t kConditionsOfOnePanel = 4;
/// Lines of a panel that are told apart.
constexpr std::size_t kLinesMax = 8;
/// Panels of a study: beyond it a report would be pictures of p alone.
constexpr std::size_t kPanelsMax = 240;
/// More points than these a line does not show.
constexpr std::size_t kLinePointsMax = 1000;
/// Beyond it the axis ends.
constexpr double kLeastP = 1e-8;

/// How surely the first is ahead, by a one-sided p: 0 at p = .5 and -log10(2 p) below it; as much
/// downwards where the second is ahead.
double evidence(double p) {
  const double tail = std::max(std::min(p, 1 - p), kLeastP);
  return (p < .5 ? -1 : 1) * std::log10(2 * tail);
}

/// p over roll-outs of pairs, and what is said of them.
struct PValuePanel {
  std::string title;
  std::string ahead = "first ahead";    ///< said at the upper end
  std::string behind = "second ahead";  ///< and at the lower one
  std::vector<std::string> labels;      ///< of lines 1, 2, ..; an empty one is not drawn
  /// By label: p, and p of the family (family_wise()).
  std::vector<Comparison::ByRollout> p;
  std::vector<Comparison::ByRollout> p_family;
};

/// Two conditions of a group, by place, and what their tests came to.
struct Pair {
  std::size_t first = 0;
  std::size_t second = 0;
  Comparison::ByRollout p;
  Comparison::ByRollout p_family;
};

/// All pairs of a group: one family of tests.
std::vector<Pair> pairs_within(const StudyResults& study, const ConditionGroup& group) {
  std::vector<Comparison> family;
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < group.conditions.size(); ++a) {
    for (std::size_t b = a + 1; b < group.conditions.size(); ++b) {
      family.push_back(compare(group.labels[a], runs_of(study, group.conditions[a]),
                               group.labels[b], runs_of(study, group.conditions[b]), false));
      pairs.push_back({.first = a, .second = b, .p = family.back().p, .p_family = {}});
    }
  }
  auto adjusted = family_wise(family);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].p_family = std::move(adjusted[i]);
  return pairs;
}

void add_line(std::size_t line, const std::string& label, Pair& pair, PValuePanel& panel) {
  panel.labels.resize(line + 1);
  panel.p.resize(line + 1);
  panel.p_family.resize(line + 1);
  panel.labels[line] = label;
  panel.p[line] = std::move(pair.p);
  panel.p_family[line] = std::move(pair.p_family);
}

/// One panel of all pairs, or of many one for each first condition and eight others: there the same
/// line is the same condition in every panel.
std::vector<PValuePanel> panels_of_pairs(const StudyResults& study, const ConditionGroup& group) {
  const std::vector<std::string>& labels = group.labels;
  const bool is_one = labels.size() <= kConditionsOfOnePanel;
  std::vector<PValuePanel> panels;
  std::pair<std::size_t, std::size_t> place;  // of the last panel: first condition, its others
  for (Pair& pair : pairs_within(study, group)) {
    const std::pair here(pair.first, (pair.second - 1) / kLinesMax);
    if (panels.empty() || (!is_one && here != place)) {
      PValuePanel& panel = panels.emplace_back();
      panel.title = group.name.empty() ? study.name : group.name;
      if (!is_one) {
        panel.title = fmt::format("{}{}{} over others", group.name, group.name.empty() ? "" : ": ",
                                  labels[pair.first]);
        panel.ahead = labels[pair.first] + " ahead";
        panel.behind = "other ahead";
      }
      place = here;
    }
    if (is_one) {
      add_line(panels.back().labels.size(), labels[pair.first] + " over " + labels[pair.second],
               pair, panels.back());
    } else {
      add_line((pair.second - 1) % kLinesMax, labels[pair.second], pair, panels.back());
    }
  }
  return panels;
}

/// The labels of the lines of a page, where no panel names one otherwise; else nothing.
std::vector<std::string> shared_labels(const std::vector<const PValuePanel*>& panels) {
  std::vector<std::string> shared;
  for (const PValuePanel* panel : panels) {
    if (panel->labels.size() > shared.size()) shared.resize(panel->labels.size());
    for (std::size_t i = 0; i < panel->labels.size(); ++i) {
      if (panel->labels[i].empty()) continue;
      if (!shared[i].empty() && shared[i] != panel->labels[i]) return {};
      shared[i] = panel->labels[i];
    }
  }
  return shared;
}

/// @param largest  evidence on the page
std::string axis_of_p(double largest) {
  constexpr double kLeastReach = 1e-4;
  std::string marks;
  const double reach = std::max(largest, evidence(kLeastReach));
  for (const auto& [text, p] :
       {std::pair{"1e-8", 1e-8}, {"1e-6", 1e-6}, {"1e-4", 1e-4}, {".01", .01}, {".05", .05}}) {
    // Two marks close together cannot be read.
    if (evidence(p) > reach || (p == .01 && reach > evidence(1e-5))) continue;
    marks += fmt::format(", '{0}' {1:.6g}, '{0}' -{1:.6g}", text, evidence(p));
  }
  const double level = evidence(.05);
  // Beyond the reach there is room to say who is ahead.
  return fmt::format(
      "  set xlabel 'roll-out'; set ylabel 'p, one-sided'\n"
      "  set yrange [-{0:.6g}:{0:.6g}]; set ytics ('.5' 0{1})\n"
      "  set arrow 1 from graph 0, first {2:.6g} to graph 1, first {2:.6g} nohead lc rgb "
      "'#888888'\n"
      "  set arrow 2 from graph 0, first -{2:.6g} to graph 1, first -{2:.6g} nohead lc rgb "
      "'#888888'\n",
      1.2 * reach, marks, level);
}

/// @param step  every so many roll-outs are drawn
std::string commands_of(const PValuePanel& panel, const std::string& axes, std::size_t step,
                        std::size_t& index, std::string& data) {
  std::string lines;
  std::string marks;
  for (std::size_t line = 0; line < panel.labels.size(); ++line) {
    if (panel.labels[line].empty()) continue;
    data += "# rollout p evidence p_family\n";
    for (std::size_t i = 0; i < panel.p[line].size(); i += step) {
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
      const auto& p = panel.p[line][i];
      data += fmt::format("{} {} {} {}\n", i + 1, datum(p.value_or(kNone)),
                          datum(p ? evidence(*p) : kNone),
                          datum(panel.p_family[line][i].value_or(kNone)));
    }
    data += "\n\n";
    lines += fmt::format("{}data index {} using 1:3 with lines lt {} lw 1 title {}",
                         lines.empty() ? "" : ", ", index, line + 1, literal(panel.labels[line]));
    marks +=
        fmt::format(", data index {} using 1:($4 < .05 ? $3 : NaN) with points lt {} ps .5 notitle",
                    index, line + 1);
    ++index;
  }
  return fmt::format(
      "{}  set title {}\n"
      "  set label 1 {} at graph .99, graph .96 right\n"
      "  set label 2 {} at graph .99, graph .04 right\n"
      "  plot {}{}\n",
      axes, literal(panel.title), literal(panel.ahead), literal(panel.behind), lines, marks);
}

Plot p_value_page(const Rows<PValuePanel>& rows) {
  std::size_t length = 1;
  double largest = 0;
  std::vector<const PValuePanel*> panels;
  for (const auto& row : rows) {
    for (const PValuePanel& panel : row) {
      panels.push_back(&panel);
      for (const auto& of_pair : panel.p) {
        length = std::max(length, of_pair.size());
        for (const auto& p : of_pair) {
          if (p) largest = std::max(largest, std::abs(evidence(*p)));
        }
      }
    }
  }
  PanelGrid grid{.rows = {}, .labels = shared_labels(panels), .panel_height_px = 340};
  const std::string axes = fmt::format(
      "  {}; set xrange [0:{}]; set xtics {}\n{}",
      grid.labels.empty() ? "set key above horizontal Left reverse samplen 4" : "unset key", length,
      round_step(static_cast<double>(length)), axis_of_p(largest));
  const std::size_t step = (length + kLinePointsMax - 1) / kLinePointsMax;
  Plot plot;
  std::size_t index = 0;
  for (const auto& row : rows) {
    grid.rows.emplace_back();
    for (const PValuePanel& panel : row) {
      grid.rows.back().push_back(commands_of(panel, axes, step, index, plot.data));
    }
  }
  arrange(grid, plot);
  plot.caption =
      "p of Welch's one-sided t-test at each roll-out, of that roll-out alone: upwards where the "
      "first condition named has the higher mean, downwards where the second has. The grey lines "
      "are at .05. Marks stand where a difference remains below .05, two-sided, by Holm's "
      "correction over all roll-outs and all pairs of conditions that are compared under one "
      "heading: the chance that any mark there is false is at most 5 %.";
  if (step > 1) plot.caption += fmt::format(" One of {} roll-outs is drawn.", step);
  return plot;
}

/// What a group is called where it is left out.
std::string called(const ConditionGroup& group) {
  return group.name.empty() ? listed(group.labels) : group.name;
}

/// What is set against what, for a title.
std::string versus(const ConditionGroup& group) {
  return group.labels.size() == 2 ? group.labels[0] + " and " + group.labels[1]
                                  : listed(group.labels);
}

}  // namespace

Figures p_values(const StudyResults& study, std::size_t place) {
  std::vector<ConditionGroup> compared;
  std::vector<std::string> too_few_runs;
  for (const ConditionGroup& group : group(conditions_of(study), place)) {
    if (group.conditions.size() < 2) continue;
    if (std::any_of(group.conditions.begin(), group.conditions.end(),
                    [&](const auto& condition) { return runs_of(study, condition).size() < 2; })) {
      too_few_runs.push_back(called(group));
    } else {
      compared.push_back(group);
    }
  }
  Figures figures{.plots = {}};
  Rows<PValuePanel> rows;
  std::size_t num_panels = 0;
  std::vector<std::string> too_many;
  for (const auto& beside :
       rows_by(compared, [](const ConditionGroup& group) { return group.row; })) {
    Rows<PValuePanel> of_groups;
    for (const ConditionGroup& group : beside) {
      of_groups.push_back(panels_of_pairs(study, group));
      num_panels += of_groups.back().size();
      if (num_panels > kPanelsMax) {
        too_many.push_back(called(group));
        num_panels -= of_groups.back().size();
        of_groups.pop_back();
      }
    }
    const bool is_one_each = std::all_of(of_groups.begin(), of_groups.end(),
                                         [](const auto& panels) { return panels.size() == 1; });
    if (is_one_each) rows.emplace_back();
    for (auto& panels : of_groups) {
      if (!is_one_each) rows.emplace_back();
      std::move(panels.begin(), panels.end(), std::back_inserter(rows.back()));
    }
  }
  std::erase_if(rows, [](const auto& row) { return row.empty(); });
  const std::string id = place == 1   ? "p_values"
                         : place == 2 ? "p_values_across"
                                      : fmt::format("p_values_across_{}", place);
  const auto pages = pages_of_rows(std::move(rows));
  for (std::size_t page = 0; page < pages.size(); ++page) {
    Plot plot = p_value_page(pages[page]);
    plot.title = fmt::format("Which of {} is ahead in {}", versus(compared.front()), study.name);
    plot.caption += caption_of_runs_that_go_on(study);
    name_page(id, page, pages.size(), plot);
    figures.plots.push_back(std::move(plot));
  }
  if (!too_many.empty()) {
    figures.left_out.push_back(
        fmt::format("p over roll-outs is drawn in at most {} panels for each part of the "
                    "conditions' names. Left out: {}.",
                    kPanelsMax, listed(too_many)));
  }
  if (!too_few_runs.empty()) {
    figures.left_out.push_back("p over roll-outs is not drawn where a condition has one run: " +
                               listed(too_few_runs) + ".");
  }
  return figures;
}

}  // namespace treeroll::report
