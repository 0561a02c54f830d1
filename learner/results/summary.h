#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "learner/core/recheck_record.h"
#include "learner/core/run_record.h"
#include "learner/core/study.h"
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
  /// Of that mean over the runs; of one run alone: over the evaluations of its policy.
  std::optional<Interval> final_interval_95;
  /// mean_reward() over the runs whose start policy was evaluated: one that failed counts with 0,
  /// as a final policy's evaluation does.
  std::optional<double> mean_start_reward;
  int num_compared = 0;           ///< runs with a start and a final reward
  int num_not_beating_start = 0;  ///< of these: neither best nor final policy is better
  bool is_deterministic = true;   ///< one policy always had one reward
  std::int64_t num_rollouts = 0;  ///< applied
  std::int64_t num_failed = 0;
  std::array<std::int64_t, kNumRolloutStatuses> by_status{};
  std::string last_failure;  ///< "repetition 3, roll-out 17: diverged: ..."; empty: none
  std::int64_t num_discarded = 0;
  std::int64_t num_switches = 0;
  int num_runs_switched = 0;
  std::optional<double> median_first_switch;  ///< roll-outs before it, over the runs that
                                              ///< switched

  /// The policy to take: the best one seen or, where one policy has different rewards, so that the
  /// best of many is luck, the mean policy with the highest reward.
  struct Recommendation {
    std::string file;  ///< in the state directory
    bool is_final = false;
    int repetition = 0;
    double reward = 0;
    std::optional<Interval> interval_95 = {};  ///< over its evaluations
    int num_evaluations = 1;
  };
  std::optional<Recommendation> recommended;  ///< nothing where no reward was positive
};

/// What the tasks of conditions say: whether the same policy has always the same reward. Of a
/// condition that is not in it, that is found out from the results: the start policy of several
/// repetitions, the final one of several evaluations.
using Determinism = std::map<std::string, bool>;

/// As far as the study holds what its tasks said of themselves.
Determinism determinism_of(const Study& study);

/// A row a condition, in the study's order.
std::vector<ConditionSummary> summarize(const std::vector<RunRecord>& runs,
                                        const Determinism& known = {});

/// What is to be known of a condition besides its row, a sentence each: what failed, whether the
/// start was beaten, which policy to take.
std::vector<std::string> remarks(const ConditionSummary& summary);

/// Why nothing can have been learnt: no roll-out had a positive reward. Empty if one had, or there
/// was none.
std::string why_nothing_was_learnt(const std::vector<ConditionSummary>& conditions);

/// What a study has come to.
struct StudySummary {
  std::string study;
  std::vector<ConditionSummary> conditions;
  LedgerCounters ledger;
  std::vector<WorkerRecord> workers;
  double elapsed_s = 0;
  /// Accepted results by the numeric class of their workers, as far as it is known.
  std::map<std::string, std::int64_t> results_by_class = {};
  RecheckRecord rechecks = {};
};

/// "[0.412, 0.518]", "-" if there is none.
std::string shown_interval(const std::optional<Interval>& interval);

/// Aligned columns for people, a line a condition, with a heading; "-" for an absent figure. The
/// remarks stand below.
std::string to_table(const std::vector<ConditionSummary>& conditions);

/// One JSON object (study, seconds, conditions, ledger, workers, numeric_classes, rechecks); null
/// for an absent figure.
std::string to_json(const StudySummary& summary);

}  // namespace treeroll
