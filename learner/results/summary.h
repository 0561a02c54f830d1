#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "learner/core/run_record.h"
#include "learner/results/statistics.h"

namespace treeroll {

/// One row of the table at a study's end. Figures that do not exist (no result yet, one repetition,
/// no switch) are absent, never NaN.
struct ConditionSummary {
  std::string condition;
  int num_runs = 0;
  // Over the best rewards of those runs that have a result.
  std::optional<double> mean_best_reward;
  std::optional<Interval> interval_95;  ///< of the mean
  std::optional<double> median_best_reward;
  std::optional<double> best_reward;
  std::optional<double> mean_final_reward;  ///< over those runs whose final policy was evaluated
  std::int64_t num_rollouts = 0;            ///< applied
  std::int64_t num_failed = 0;
  std::int64_t num_switches = 0;
  int num_runs_switched = 0;
  std::optional<double> median_first_switch;  ///< roll-outs before it, over the runs that
                                              ///< switched
};

/// A row a condition, in the study's order.
std::vector<ConditionSummary> summarize(const std::vector<RunRecord>& runs);

/// What a study has come to.
struct StudySummary {
  std::string study;
  std::vector<ConditionSummary> conditions;
  LedgerCounters ledger;
  std::vector<WorkerRecord> workers;
  double elapsed_s = 0;
  /// Accepted results by the numeric class of their workers, as far as it is known.
  std::map<std::string, std::int64_t> results_by_class = {};
};

/// Aligned columns for people, a line a condition, with a heading; "-" for an absent figure.
std::string to_table(const std::vector<ConditionSummary>& conditions);

/// One JSON object (study, seconds, conditions, ledger, workers, numeric_classes); null for an
/// absent figure.
std::string to_json(const StudySummary& summary);

}  // namespace treeroll
