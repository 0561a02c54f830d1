#include "learner/results/summary.h"

#include <algorithm>
#include <map>

#include "learner/results/run_counts.h"

namespace treeroll {
namespace {

ConditionSummary summarize_condition(const std::vector<const RunRecord*>& runs) {
  ConditionSummary summary;
  summary.condition = runs.front()->condition;
  summary.num_runs = static_cast<int>(runs.size());
  std::vector<double> best;
  std::vector<double> final_rewards;
  std::vector<double> first_switches;
  for (const RunRecord* run : runs) {
    if (run->best_rollout >= 0) best.push_back(run->best_reward);
    if (run->final_reward) final_rewards.push_back(*run->final_reward);
    if (!run->switches.empty()) first_switches.push_back(rollouts_before_switch(*run));
    summary.num_rollouts += num_applied(*run);
    summary.num_failed += num_failed(*run);
    summary.num_switches += static_cast<std::int64_t>(run->switches.size());
  }
  summary.mean_best_reward = mean(best);
  summary.interval_95 = mean_interval_95(best);
  summary.median_best_reward = median(best);
  if (!best.empty()) summary.best_reward = *std::max_element(best.begin(), best.end());
  summary.mean_final_reward = mean(final_rewards);
  summary.num_runs_switched = static_cast<int>(first_switches.size());
  summary.median_first_switch = median(first_switches);
  return summary;
}

}  // namespace

std::vector<ConditionSummary> summarize(const std::vector<RunRecord>& runs) {
  std::map<int, const RunRecord*> by_number;
  for (const RunRecord& run : runs) by_number.emplace(run.run, &run);
  // Runs of one condition follow each other by number.
  std::vector<std::vector<const RunRecord*>> groups;
  for (const auto& [number, run] : by_number) {
    if (groups.empty() || groups.back().front()->condition != run->condition) groups.emplace_back();
    groups.back().push_back(run);
  }
  std::vector<ConditionSummary> summaries;
  summaries.reserve(groups.size());
  for (const auto& group : groups) summaries.push_back(summarize_condition(group));
  return summaries;
}

}  // namespace treeroll
