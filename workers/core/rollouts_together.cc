#include "workers/core/rollouts_together.h"

#include <algorithm>

namespace treeroll::worker {
std::size_t num_together(const HeldRollout& held, const Definition& task, std::size_t num_held,
                         const WorkerSettings& settings) {
  const bool is_known = task.rollout_time > Duration{};
  if (!is_known || !task.facts.repeatable || held.mishaps.alone) return 1;
  const auto by_time = static_cast<std::size_t>(settings.together_time_max / task.rollout_time);
  const auto num_evaluators = static_cast<std::size_t>(settings.num_evaluators);
  const auto by_share = (num_held + 2 * num_evaluators - 1) / (2 * num_evaluators);
  return std::max<std::size_t>(1, std::min({by_time, by_share, settings.together_max}));
}

}  // namespace treeroll::worker
