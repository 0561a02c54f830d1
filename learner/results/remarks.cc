#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <numeric>

#include "common/base/shown_reward.h"
#include "learner/results/summary.h"

namespace treeroll {
namespace {

std::string failures(const ConditionSummary& c) {
  std::vector<std::string> kinds;
  for (std::size_t i = 1; i < c.by_status.size(); ++i) {
    if (c.by_status[i] == 0) continue;
    kinds.push_back(
        fmt::format("{} {}", c.by_status[i], name_of_failure(static_cast<RolloutStatus>(i))));
  }
  return fmt::format("{} of {} roll-outs failed: {}; the last: {}", c.num_failed, c.num_rollouts,
                     fmt::join(kinds, ", "), c.last_failure);
}

std::string advice(const ConditionSummary& c) {
  const ConditionSummary::Recommendation& chosen = *c.recommended;
  std::string text = fmt::format("take {}, the {} of repetition {}: reward {}", chosen.file,
                                 chosen.is_final ? "final mean policy" : "best roll-out",
                                 chosen.repetition, shown_reward(chosen.reward));
  if (chosen.interval_95) {
    text += fmt::format(" {} over {} evaluations", shown_interval(chosen.interval_95),
                        chosen.num_evaluations);
  }
  if (!c.is_deterministic) {
    text +=
        "; the task gives one policy different rewards, so the highest reward of many roll-outs is "
        "luck";
    if (chosen.num_evaluations == 1) text += ", and study.final_evaluations = 20 says more";
  }
  return text;
}

}  // namespace

std::string shown_interval(const std::optional<Interval>& interval) {
  if (!interval) return "-";
  return fmt::format("[{}, {}]", shown_reward(interval->low), shown_reward(interval->high));
}

std::vector<std::string> remarks(const ConditionSummary& c) {
  std::vector<std::string> said;
  const auto say = [&](const std::string& text) {
    said.push_back(fmt::format("{}: {}", c.condition, text));
  };
  if (c.num_rollouts > 0 && c.best_reward.value_or(0) == 0) {
    say(fmt::format("no roll-out of {} had a positive reward: there was nothing to learn from",
                    c.num_rollouts));
  }
  if (c.num_failed > 0) say(failures(c));
  if (c.num_discarded > 0) {
    say(fmt::format("{} trials were discarded and made again", c.num_discarded));
  }
  if (c.by_status[static_cast<std::size_t>(RolloutStatus::kDiscarded)] > 0) {
    say("a run has ended early, as the trials of one roll-out were discarded more often than "
        "study.discards_max allows");
  }
  if (c.num_not_beating_start > 0) {
    say(fmt::format("{} of {} runs never beat the start policy, whose reward is {}",
                    c.num_not_beating_start, c.num_compared,
                    shown_reward(c.mean_start_reward.value_or(0))));
  }
  if (c.num_runs == 1 && c.final_interval_95) {
    say("of one run the interval of the final reward is over the evaluations of its policy; other "
        "runs may come to other policies");
  }
  if (c.recommended) say(advice(c));
  return said;
}

std::string why_nothing_was_learnt(const std::vector<ConditionSummary>& conditions) {
  std::int64_t num_rollouts = 0;
  std::int64_t num_failed = 0;
  std::string last_failure;
  for (const ConditionSummary& c : conditions) {
    if (c.best_reward.value_or(0) > 0) return "";
    num_rollouts += c.num_rollouts;
    num_failed += c.num_failed;
    if (!c.last_failure.empty()) last_failure = c.condition + ", " + c.last_failure;
  }
  if (num_rollouts == 0) return "";
  if (num_failed == num_rollouts) {
    return fmt::format("all {} roll-outs failed, the last: {}", num_rollouts, last_failure);
  }
  std::string why = fmt::format("none of {} roll-outs had a positive reward", num_rollouts);
  if (num_failed > 0) why += fmt::format(", and {} failed, the last: {}", num_failed, last_failure);
  return why + "; a start policy or a reward from which there is something to learn is needed";
}

}  // namespace treeroll
