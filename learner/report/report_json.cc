#include <nlohmann/json.hpp>

#include "learner/report/report_sections.h"
#include "learner/results/run_counts.h"
#include "learner/results/summary.h"

namespace treeroll::report {
namespace {

using nlohmann::json;

template <class T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}
json or_null(const std::optional<Interval>& interval) {
  return interval ? json{interval->low, interval->high} : json();
}

json or_null(const Comparison::ByRollout& values) {
  json all = json::array();
  for (const auto& value : values) all.push_back(or_null(value));
  return all;
}

json to_json(const Claim& claim, const ClaimResult& result, const std::optional<double>& adjusted) {
  return {{"claim", claim.text},
          {"section", claim.section},
          {"study", claim.study},
          {"conditions", claim.conditions},
          {"measure", describe(claim.measure)},
          {"against", describe(claim.against)},
          {"measured", result.measured},
          {"n", result.n},
          {"p", or_null(result.p)},
          {"p_holm", or_null(adjusted)},
          {"interval_95", or_null(result.interval)},
          {"verdict", name(result.verdict)}};
}

json to_json(const StudyResults& study) {
  json conditions = json::array();
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    std::vector<double> end;
    std::vector<double> first_switches;
    for (const MeasuredRun& run : runs_of(study, summary.condition)) {
      if (const auto value = measure(run, {})) end.push_back(*value);
      if (!run->switches.empty()) first_switches.push_back(rollouts_before_switch(*run));
    }
    json switches;
    if (const auto found = quartiles(first_switches)) {
      switches = {{"lower_quartile", found->low},
                  {"median", found->median},
                  {"upper_quartile", found->high},
                  {"runs", first_switches.size()}};
    }
    conditions.push_back({{"condition", summary.condition},
                          {"runs", summary.num_runs},
                          {"rollouts", summary.num_rollouts},
                          {"failed", summary.num_failed},
                          {"near_end", or_null(mean(end))},
                          {"near_end_interval_95", or_null(mean_interval_95(end))},
                          {"best_reward", or_null(summary.mean_best_reward)},
                          {"best_reward_interval_95", or_null(summary.interval_95)},
                          {"final_reward", or_null(summary.mean_final_reward)},
                          {"final_reward_interval_95", or_null(summary.final_interval_95)},
                          {"start_reward", or_null(summary.mean_start_reward)},
                          {"discarded", summary.num_discarded},
                          {"last_failure", summary.last_failure},
                          {"remarks", remarks(summary)},
                          {"first_switch", switches}});
  }
  return {{"study", study.name},
          {"missing", study.missing.empty() ? json(nullptr) : json(study.missing)},
          {"conditions", conditions}};
}

/// NaN is null.
json to_json(const std::vector<PolicyTerms>& terms) {
  json all = json::array();
  for (const PolicyTerms& one : terms) {
    all.push_back({{"condition", one.condition}, {"start", one.start}, {"best", one.best}});
  }
  return all;
}

json to_json(const Comparison& comparison) {
  json entry = {{"first", comparison.a},
                {"second", comparison.b},
                {"n", {comparison.num_a, comparison.num_b}},
                {"means", {or_null(comparison.mean_a), or_null(comparison.mean_b)}},
                {"hedges_g", or_null(comparison.g)},
                {"p_over_rollouts", or_null(comparison.p)},
                {"p_over_rollouts_holm", or_null(comparison.p_holm)},
                {"p", nullptr},
                {"difference_interval_95", nullptr},
                {"paired_p", nullptr}};
  if (comparison.end) {
    entry["p"] = comparison.end->p;
    entry["difference_interval_95"] = {comparison.end->interval_95.low,
                                       comparison.end->interval_95.high};
  }
  if (comparison.paired) entry["paired_p"] = comparison.paired->p;
  return entry;
}

}  // namespace

std::string report_json(const std::vector<Claim>& claims, const std::vector<ClaimResult>& results,
                        const std::vector<StudyResults>& studies,
                        const std::vector<Comparison>& comparisons,
                        const std::vector<std::vector<PolicyTerms>>& terms) {
  json report = {
      {"claims", json::array()}, {"studies", json::array()}, {"comparisons", json::array()}};
  const std::vector<std::optional<double>> adjusted = adjusted_p(results);
  for (std::size_t i = 0; i < claims.size(); ++i) {
    report["claims"].push_back(to_json(claims[i], results[i], adjusted[i]));
  }
  for (std::size_t i = 0; i < studies.size(); ++i) {
    report["studies"].push_back(to_json(studies[i]));
    if (i < terms.size() && !terms[i].empty()) {
      report["studies"].back()["terms"] = to_json(terms[i]);
    }
  }
  for (const Comparison& comparison : comparisons) {
    report["comparisons"].push_back(to_json(comparison));
  }
  return report.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace treeroll::report
