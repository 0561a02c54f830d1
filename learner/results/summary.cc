#include "learner/results/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "common/task_facts/task_agreement.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"

namespace treeroll {
namespace {

using Runs = std::vector<const RunRecord*>;

bool differ(const std::vector<double>& rewards) {
  return std::ranges::any_of(rewards, [&](double reward) { return reward != rewards.front(); });
}

/// All runs of a condition start from one policy.
std::vector<Outcome> starts_of(const Runs& runs) {
  std::vector<Outcome> starts;
  for (const RunRecord* run : runs) {
    if (run->start) starts.push_back(*run->start);
  }
  return starts;
}

/// A start that crashed on one host says nothing of the task.
bool rewards_differ_for_one_policy(const Runs& runs) {
  std::vector<Outcome> starts = starts_of(runs);
  std::erase_if(starts, [](const Outcome& start) { return !start.is_ok(); });
  return differ(rewards_of(starts)) || std::ranges::any_of(runs, [](const RunRecord* run) {
           return differ(rewards_of(run->finals));
         });
}

/// Where one reward is luck, the start's is the mean over the runs, and a best roll-out says
/// nothing.
void compare_with_start(const Runs& runs, ConditionSummary& summary) {
  for (const RunRecord* run : runs) {
    if (!run->start || run->start->is_discarded() || !run->final_reward) continue;
    ++summary.num_compared;
    const double start =
        summary.is_deterministic ? run->start->reward() : summary.mean_start_reward.value_or(0);
    const bool best_is_better = summary.is_deterministic && run->best_reward > start;
    if (!best_is_better && *run->final_reward <= start) ++summary.num_not_beating_start;
  }
}

void recommend(const Runs& runs, ConditionSummary& summary) {
  std::optional<ConditionSummary::Recommendation>& chosen = summary.recommended;
  const auto offer = [&chosen](ConditionSummary::Recommendation offered) {
    if (offered.reward > (chosen ? chosen->reward : 0)) chosen = std::move(offered);
  };
  for (const RunRecord* run : runs) {
    if (summary.is_deterministic && run->best_rollout >= 0 && !run->best_policy.empty()) {
      offer({.file = best_policy_file(*run),
             .repetition = run->repetition,
             .reward = run->best_reward});
    }
    if (run->final_reward && !run->final_policy.empty()) {
      const std::vector<double> rewards = rewards_of(run->finals);
      offer({.file = final_policy_file(*run),
             .is_final = true,
             .repetition = run->repetition,
             .reward = *run->final_reward,
             .interval_95 = mean_interval_95(rewards),
             .num_evaluations = static_cast<int>(rewards.size())});
    }
  }
}

ConditionSummary summarize_condition(const Runs& runs, const Determinism& known) {
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
    for (int i = 0; i < kNumRolloutStatuses; ++i) {
      summary.by_status[static_cast<std::size_t>(i)] +=
          num_with(*run, static_cast<RolloutStatus>(i));
    }
    summary.num_discarded += run->num_discarded;
    if (const std::string failure = last_failure(*run); !failure.empty()) {
      summary.last_failure = fmt::format("repetition {}, {}", run->repetition, failure);
    }
    summary.num_switches += static_cast<std::int64_t>(run->switches.size());
  }
  summary.mean_best_reward = mean(best);
  summary.interval_95 = mean_interval_95(best);
  summary.median_best_reward = median(best);
  if (!best.empty()) summary.best_reward = *std::max_element(best.begin(), best.end());
  summary.mean_final_reward = mean(final_rewards);
  summary.final_interval_95 = runs.size() > 1 ? mean_interval_95(final_rewards)
                                              : mean_interval_95(rewards_of(runs[0]->finals));
  summary.mean_start_reward = mean_reward(starts_of(runs));
  const auto said = known.find(summary.condition);
  summary.is_deterministic =
      said != known.end() ? said->second : !rewards_differ_for_one_policy(runs);
  compare_with_start(runs, summary);
  recommend(runs, summary);
  summary.num_runs_switched = static_cast<int>(first_switches.size());
  summary.median_first_switch = median(first_switches);
  return summary;
}

}  // namespace

Determinism determinism_of(const Study& study) {
  Determinism known;
  for (const Condition& condition : study.conditions) {
    const std::optional<TaskDescription> described = described_in(condition.task_content);
    if (described) known[condition.name] = described->deterministic;
  }
  return known;
}

std::vector<ConditionSummary> summarize(const std::vector<RunRecord>& runs,
                                        const Determinism& known) {
  std::map<int, const RunRecord*> by_number;
  for (const RunRecord& run : runs) by_number.emplace(run.run, &run);
  // Runs of one condition follow each other by number.
  std::vector<Runs> groups;
  for (const auto& [number, run] : by_number) {
    if (groups.empty() || groups.back().front()->condition != run->condition) groups.emplace_back();
    groups.back().push_back(run);
  }
  std::vector<ConditionSummary> summaries;
  summaries.reserve(groups.size());
  for (const auto& group : groups) summaries.push_back(summarize_condition(group, known));
  return summaries;
}

}  // namespace treeroll
