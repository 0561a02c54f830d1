#include "learner/results/run_counts.h"

#include <fmt/format.h>

namespace treeroll {

std::string reason_of(const RunRecord& run, const RolloutRecord& rollout) {
  if (rollout.reason == 0) return "";
  if (rollout.reason <= run.reasons.size()) return run.reasons[rollout.reason - 1];
  return fmt::format("one of more than {} different reasons, which the journal has",
                     kReasonsPerRunMax);
}

std::string last_failure(const RunRecord& run) {
  for (std::size_t i = run.rollouts.size(); i-- > 0;) {
    const RolloutRecord& rollout = run.rollouts[i];
    if (!is_applied(rollout) || rollout.status == RolloutStatus::kOk) continue;
    const std::string reason = reason_of(run, rollout);
    return fmt::format("roll-out {}: {}{}{}", i, name(rollout.status), reason.empty() ? "" : ": ",
                       reason);
  }
  return "";
}

std::vector<double> rewards_of(const std::vector<Outcome>& evaluations) {
  std::vector<double> rewards;
  for (const Outcome& outcome : evaluations) {
    if (!outcome.is_discarded()) rewards.push_back(outcome.reward());
  }
  return rewards;
}

}  // namespace treeroll
