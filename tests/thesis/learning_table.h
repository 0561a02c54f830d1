#pragma once

#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

/// How soon the runs of one condition came to a reward.
struct LearningRow {
  std::string condition;
  int runs = 0;
  double start = 0;           ///< reward of the start policy
  std::vector<int> rollouts;  ///< until the first reward of at least the target, ascending, by run
  double mean_best = 0;
  double mean_near_end = 0;  ///< of each run's last five rewards

  /// Share of the runs that had it within so many roll-outs.
  double share_at(int rollouts) const;
  /// Roll-outs within which a share of all runs had it, above 0 to 1; -1 where fewer ever had.
  int rollouts_for(double share) const;
};

/// A row for each condition, in the order of the records.
std::vector<LearningRow> learning_rows(const std::vector<RunRecord>& runs, double target);

/// As a Markdown table.
std::string learning_table(const std::vector<LearningRow>& rows, const std::vector<int>& budgets);

}  // namespace treeroll
