#include "common/base/rollout_status.h"

#include "common/base/check.h"

namespace treeroll {

std::string_view name(RolloutStatus status) {
  switch (status) {
    case RolloutStatus::kOk:
      return "ok";
    case RolloutStatus::kDiverged:
      return "diverged";
    case RolloutStatus::kFailed:
      return "failed";
    case RolloutStatus::kCrashed:
      return "crashed";
    case RolloutStatus::kTimedOut:
      return "timed_out";
    case RolloutStatus::kDiscarded:
      return "discarded";
  }
  CHECK(false, "a RolloutStatus outside its enumeration");
}

std::optional<RolloutStatus> rollout_status(std::string_view word) {
  for (int i = 0; i < kNumRolloutStatuses; ++i) {
    const auto status = static_cast<RolloutStatus>(i);
    if (name(status) == word) return status;
  }
  return std::nullopt;
}

}  // namespace treeroll
