#include "learner/report/report_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>

#include "common/base/shown_reward.h"
#include "learner/report/figures/condition_grid.h"
#include "learner/results/run_counts.h"
#include "learner/results/summary.h"

namespace treeroll::report {
namespace {

/// Rows of a table of comparisons.
constexpr std::size_t kPairsMax = 400;
constexpr std::size_t kTermRowsMax = 400;

std::string number(const std::optional<double>& value) {
  return value ? shown_reward(*value) : "-";
}
std::string text(const std::optional<Interval>& interval) { return shown_interval(interval); }
std::string text_of_p(const std::optional<double>& p) {
  if (!p) return "-";
  return *p < 1e-6 ? "< 1e-6" : fmt::format("{:.2g}", *p);
}

std::vector<double> present(const std::vector<MeasuredRun>& runs, const Measure& wanted) {
  std::vector<double> values;
  for (const MeasuredRun& run : runs) {
    if (const auto value = measure(run, wanted)) values.push_back(*value);
  }
  return values;
}

Table reward_table(const StudyResults& study) {
  Table table{.columns = {"condition", "runs", "start policy: mean", "near the end: mean", "95 %",
                          "median", "best roll-out: mean", "95 %", "mean policy: mean", "95 %",
                          "roll-outs", "failed roll-outs", "runs without an end"},
              .rows = {}};
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    const auto runs = runs_of(study, summary.condition);
    const auto end = present(runs, {});
    const auto final_rewards = present(runs, {.kind = MeasureKind::kFinal});
    const auto lacking = runs.size() - final_rewards.size();
    table.rows.push_back({{summary.condition, ""},
                          {std::to_string(summary.num_runs), ""},
                          {number(summary.mean_start_reward), ""},
                          {number(mean(end)), ""},
                          {text(mean_interval_95(end)), ""},
                          {number(median(end)), ""},
                          {number(summary.mean_best_reward), ""},
                          {text(summary.interval_95), ""},
                          {number(mean(final_rewards)), ""},
                          {text(summary.final_interval_95), ""},
                          {std::to_string(summary.num_rollouts), ""},
                          {std::to_string(summary.num_failed), ""},
                          {std::to_string(lacking), ""}});
  }
  return table;
}

/// Which runs go on past their end, and with what; empty if none does.
std::string runs_that_go_on(const StudyResults& study) {
  std::vector<std::string> counts;
  for (const std::string& condition : conditions_of(study)) {
    const auto runs = runs_of(study, condition);
    const auto num_done = std::ranges::count_if(runs, &MeasuredRun::goes_on);
    if (num_done > 0)
      counts.push_back(fmt::format("{} {} of {}", condition, num_done, runs.size()));
  }
  if (counts.empty()) return "";
  return fmt::format(
      "Runs that were done before the end of their budget (exploration.stop_at_reward, "
      "stop_on_convergence): {}. In curves, tests and claims each goes on to the end of its budget "
      "with the reward that it ended with: the first that reached stop_at_reward, else its last. "
      "Else later roll-outs would be of the other runs alone.",
      fmt::join(counts, ", "));
}

/// Of the conditions in which roll-outs have failed or trials were void.
Table failure_table(const StudyResults& study) {
  Table table{.columns = {"condition", "diverged", "failed", "crashed", "timed out", "given up",
                          "discarded trials", "the last failure"},
              .rows = {}};
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    if (summary.num_failed == 0 && summary.num_discarded == 0) continue;
    std::vector<Cell> row = {{summary.condition, ""}};
    for (std::size_t i = 1; i < summary.by_status.size(); ++i) {
      row.push_back({std::to_string(summary.by_status[i]), ""});
    }
    row.push_back({std::to_string(summary.num_discarded), ""});
    row.push_back({summary.last_failure.empty() ? "-" : summary.last_failure, ""});
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// Over the runs that switched.
Table switch_table(const StudyResults& study) {
  Table table{.columns = {"condition", "runs that switched", "lower quartile", "median",
                          "upper quartile", "switches"},
              .rows = {}};
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    if (summary.num_switches == 0) continue;
    std::vector<double> first;
    for (const MeasuredRun& run : runs_of(study, summary.condition)) {
      if (!run->switches.empty()) first.push_back(rollouts_before_switch(*run));
    }
    const auto found = quartiles(first);
    table.rows.push_back({{summary.condition, ""},
                          {fmt::format("{} of {}", first.size(), summary.num_runs), ""},
                          {fmt::format("{:g}", found->low), ""},
                          {fmt::format("{:g}", found->median), ""},
                          {fmt::format("{:g}", found->high), ""},
                          {std::to_string(summary.num_switches), ""}});
  }
  return table;
}

/// A row a term; of very many conditions the first.
Table term_table(const std::vector<PolicyTerms>& terms) {
  const auto shown = [](const std::map<std::string, double>& of, const std::string& name) {
    const auto found = of.find(name);
    return found == of.end() ? std::string("-") : fmt::format("{:.4g}", found->second);
  };
  Table table{.columns = {"condition", "term", "start policy", "best policy"}, .rows = {}};
  for (const PolicyTerms& one : terms) {
    std::map<std::string, double> names = one.start;
    names.insert(one.best.begin(), one.best.end());
    for (const auto& [name, number] : names) {
      if (table.rows.size() == kTermRowsMax) return table;
      table.rows.push_back({{one.condition, ""},
                            {name, ""},
                            {shown(one.start, name), ""},
                            {shown(one.best, name), ""}});
    }
  }
  return table;
}

std::string figure_of(const Claim& claim, const std::vector<Picture>& figures) {
  const std::string figure = !claim.figure.empty()                        ? claim.figure
                             : claim.measure.kind == MeasureKind::kSwitch ? "switches"
                                                                          : "learning_curves";
  const std::string id = to_id(claim.study + "-" + figure);
  const bool there = std::any_of(figures.begin(), figures.end(),
                                 [&id](const Picture& picture) { return picture.id == id; });
  return there ? id : to_id(claim.study);
}

}  // namespace

Section claims_section(const std::vector<Claim>& claims, const std::vector<ClaimResult>& results,
                       const std::vector<Picture>& figures) {
  Section section{.id = "claims", .title = "Claims", .blocks = {}};
  std::map<Verdict, int> counts;
  Table table{.columns = {"claim", "section", "what was measured", "n", "95 % interval", "p",
                          "p (Holm)", "verdict", "figure"},
              .rows = {}};
  const std::vector<std::optional<double>> adjusted = adjusted_p(results);
  int num_tests = 0;
  int num_hold_adjusted = 0;
  for (std::size_t i = 0; i < claims.size(); ++i) {
    const ClaimResult& result = results[i];
    if (adjusted[i]) ++num_tests;
    if (adjusted[i] && *adjusted[i] < .05) ++num_hold_adjusted;
    ++counts[result.verdict];
    const bool measured = result.verdict != Verdict::kNotMeasured;
    const std::string what =
        measured ? describe(claims[i]) + ": " + result.measured : result.measured;
    table.rows.push_back(
        {{claims[i].text, ""},
         {claims[i].section, ""},
         {what, ""},
         {result.n.empty() ? "-" : result.n, ""},
         {text(result.interval), ""},
         {text_of_p(result.p), ""},
         {text_of_p(adjusted[i]), ""},
         {name(result.verdict), ""},
         {measured ? claims[i].study : "-", measured ? figure_of(claims[i], figures) : ""}});
  }
  section.blocks.emplace_back(fmt::format(
      "Of {} claims {} hold, {} do not, {} are inconclusive and {} were not measured. A claim "
      "holds "
      "if its test rejects the opposite at the level of 5 %, and does not if the claim itself is "
      "rejected: each verdict is of its own claim alone. p speaks for a claim where it is small; "
      "beside it stands Holm's correction over the {} claims that are tested by a p, of which {} "
      "remain below 5 %. \"Near\" a roll-out is the mean of the five up to it.",
      claims.size(), counts[Verdict::kHolds], counts[Verdict::kFails],
      counts[Verdict::kInconclusive], counts[Verdict::kNotMeasured], num_tests, num_hold_adjusted));
  section.blocks.emplace_back(std::move(table));
  return section;
}

Section study_section(const StudyResults& study, const std::vector<Picture>& figures,
                      const std::vector<std::string>& remarks,
                      const std::vector<PolicyTerms>& terms) {
  Section section{.id = to_id(study.name), .title = "Study " + study.name, .blocks = {}};
  if (!study.missing.empty()) {
    section.blocks.emplace_back("The study is not complete: " + study.missing +
                                ". treeroll-learner --resume with its directory goes on.");
  }
  section.blocks.emplace_back(
      "Rewards of roll-outs are of perturbed policies; those of the start policy and of "
      "the mean policy are evaluated apart from the budget. Intervals are of the mean over "
      "repetitions, by Student's t; of one run, that of the mean policy is over its evaluations. A "
      "failed "
      "roll-out "
      "counts with reward 0; a run without an end was stopped before its final policy was "
      "evaluated.");
  section.blocks.emplace_back(reward_table(study));
  if (std::string ended = runs_that_go_on(study); !ended.empty()) {
    section.blocks.emplace_back(std::move(ended));
  }
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    for (const std::string& remark : treeroll::remarks(summary)) {
      section.blocks.emplace_back(remark);
    }
  }
  if (Table failures = failure_table(study); !failures.rows.empty()) {
    section.blocks.emplace_back("Roll-outs that failed, by how they ended:");
    section.blocks.emplace_back(std::move(failures));
  }
  if (Table switches = switch_table(study); !switches.rows.empty()) {
    section.blocks.emplace_back(
        "Roll-outs before the first switch of layer, over the runs that switched:");
    section.blocks.emplace_back(std::move(switches));
  }
  if (Table table = term_table(terms); !table.rows.empty()) {
    section.blocks.emplace_back(
        "What the reward of a roll-out is made of, as the task says, of the start policy and of "
        "the best roll-out's policy. Learning goes by the reward alone:");
    const bool is_full = table.rows.size() == kTermRowsMax;
    section.blocks.emplace_back(std::move(table));
    if (is_full) section.blocks.emplace_back("No more are shown; report.json has all there are.");
  }
  for (const std::string& remark : remarks) section.blocks.emplace_back(remark);
  for (const Picture& figure : figures) section.blocks.emplace_back(figure);
  return section;
}

Section comparison_section(const std::string& title, const std::vector<Comparison>& comparisons,
                           const std::vector<std::string>& remarks) {
  Section section{.id = to_id(title), .title = title, .blocks = {}};
  section.blocks.emplace_back(
      "p is of the one-sided Welch test that the first is greater near the last roll-out, with "
      "Holm's "
      "correction over this table beside it; the paired p takes repetitions that share their "
      "random "
      "numbers together. The last columns count the roll-outs at which the first is ahead with p < "
      ".05, of those at which both have two runs, plain and corrected over all of them. Within a "
      "study "
      "every two conditions are compared whose names differ in one part alone.");
  const std::vector<std::optional<double>> adjusted = adjusted_p(comparisons);
  Table table{.columns = {"first", "second", "n", "mean", "mean", "difference, 95 %", "p",
                          "p (Holm)", "paired p", "Hedges' g", "roll-outs ahead", "(Holm)"},
              .rows = {}};
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const Comparison& comparison = comparisons[i];
    const auto ahead = [](const Comparison::ByRollout& values) {
      const auto num_tested = std::count_if(values.begin(), values.end(),
                                            [](const auto& value) { return value.has_value(); });
      const auto count = std::count_if(values.begin(), values.end(),
                                       [](const auto& value) { return value && *value < .05; });
      return fmt::format("{} of {}", count, num_tested);
    };
    std::optional<double> p_end;
    std::optional<Interval> interval;
    if (comparison.end) {
      p_end = comparison.end->p;
      interval = comparison.end->interval_95;
    }
    std::optional<double> p_paired;
    if (comparison.paired) p_paired = comparison.paired->p;
    table.rows.push_back({{comparison.a, ""},
                          {comparison.b, ""},
                          {fmt::format("{}, {}", comparison.num_a, comparison.num_b), ""},
                          {number(comparison.mean_a), ""},
                          {number(comparison.mean_b), ""},
                          {text(interval), ""},
                          {text_of_p(p_end), ""},
                          {text_of_p(adjusted[i]), ""},
                          {text_of_p(p_paired), ""},
                          {number(comparison.g), ""},
                          {ahead(comparison.p), ""},
                          {ahead(comparison.p_holm), ""}});
  }
  section.blocks.emplace_back(std::move(table));
  for (const std::string& remark : remarks) section.blocks.emplace_back(remark);
  return section;
}

std::vector<Comparison> comparisons_within(const StudyResults& study) {
  std::vector<Comparison> comparisons;
  for (const auto& [a, b] : pairs_of(conditions_of(study))) {
    if (comparisons.size() == kPairsMax) break;
    comparisons.push_back(compare(a, runs_of(study, a), b, runs_of(study, b), true));
  }
  return comparisons;
}

std::string pairs_left_out(const StudyResults& study) {
  const std::size_t num_pairs = pairs_of(conditions_of(study)).size();
  if (num_pairs <= kPairsMax) return "";
  return fmt::format(
      "Of the {} pairs of {} the first {} stand here; --compare A B compares any other.", num_pairs,
      study.name, kPairsMax);
}

std::vector<Comparison> comparisons_between(const StudyResults& a, const StudyResults& b) {
  std::vector<Comparison> comparisons;
  for (const std::string& condition : conditions_of(a)) {
    const auto others = runs_of(b, condition);
    if (others.empty()) continue;
    // Whether two studies share their seed is not in their results: no pairs.
    comparisons.push_back(compare(a.name + ":" + condition, runs_of(a, condition),
                                  b.name + ":" + condition, others, false));
  }
  return comparisons;
}

}  // namespace treeroll::report
