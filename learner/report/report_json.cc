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
  const bool has_share = claim.kind == ClaimKind::kShare;
  const bool has_range =
      has_share || claim.kind == ClaimKind::kWithin || claim.kind == ClaimKind::kDeviation;
  return {{"claim", claim.text},
          {"section", claim.section},
          {"study", claim.study},
          {"conditions", claim.conditions},
          {"others", claim.others},
          {"kind", name(claim.kind)},
          {"paired", claim.paired},
          {"margin", claim.margin},
          {"range", has_range ? json{claim.low, claim.high} : json()},
          {"share", has_share ? json{claim.share_min, claim.share_max} : json()},
          {"measure", describe(claim.measure)},
          {"against", describe(claim.against)},
          {"measured", result.measured},
          {"n", result.n},
          {"p", or_null(result.p)},
          {"p_holm", or_null(adjusted)},
          {"hedges_g", or_null(result.g)},
          {"interval_95", or_null(result.interval)},
          {"verdict", name(result.verdict)}};
}

json to_json(const StudyResults& study) {
  json conditions = json::array();
  for (const ConditionSummary& summary : summarize(study.runs, study.determinism)) {
    std::vector<double> end;
    std::vector<double> first_switches;
    int num_without_end = 0;
    int num_going_on = 0;
    for (const MeasuredRun& run : runs_of(study, summary.condition)) {
      if (const auto value = measure(run, {})) end.push_back(*value);
      if (!run->final_reward) ++num_without_end;
      if (run.goes_on()) ++num_going_on;
      if (!run->switches.empty()) first_switches.push_back(rollouts_before_switch(*run));
    }
    json switches;
    if (const auto found = quartiles(first_switches)) {
      switches = {{"lower_quartile", found->low},
                  {"median", found->median},
                  {"upper_quartile", found->high},
                  {"runs", first_switches.size()}};
    }
    json failed_by_status = json::object();
    for (std::size_t i = 1; i < summary.by_status.size(); ++i) {
      const std::string failure(name_of_failure(static_cast<RolloutStatus>(i)));
      failed_by_status[failure] = summary.by_status[i];
    }
    conditions.push_back({{"condition", summary.condition},
                          {"runs", summary.num_runs},
                          {"rollouts", summary.num_rollouts},
                          {"runs_without_end", num_without_end},
                          {"runs_going_on", num_going_on},
                          {"failed", summary.num_failed},
                          {"failed_by_status", failed_by_status},
                          {"near_end", or_null(mean(end))},
                          {"near_end_median", or_null(median(end))},
                          {"near_end_interval_95", or_null(mean_interval_95(end))},
                          {"best_reward", or_null(summary.mean_best_reward)},
                          {"best_reward_median", or_null(summary.median_best_reward)},
                          {"best_reward_interval_95", or_null(summary.interval_95)},
                          {"final_reward", or_null(summary.mean_final_reward)},
                          {"final_reward_interval_95", or_null(summary.final_interval_95)},
                          {"start_reward", or_null(summary.mean_start_reward)},
                          {"discarded", summary.num_discarded},
                          {"last_failure", summary.last_failure},
                          {"remarks", remarks(summary)},
                          {"switches", summary.num_switches},
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

json to_json(const Comparison& comparison, const std::optional<double>& adjusted) {
  json entry = {{"first", comparison.a},
                {"second", comparison.b},
                {"n", {comparison.num_a, comparison.num_b}},
                {"means", {or_null(comparison.mean_a), or_null(comparison.mean_b)}},
                {"hedges_g", or_null(comparison.g)},
                {"p_over_rollouts", or_null(comparison.p)},
                {"p_over_rollouts_holm", or_null(comparison.p_holm)},
                {"p", nullptr},
                {"p_holm", or_null(adjusted)},
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
  const std::vector<std::optional<double>> adjusted_ends = adjusted_p(comparisons);
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    report["comparisons"].push_back(to_json(comparisons[i], adjusted_ends[i]));
  }
  return report.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace treeroll::report
