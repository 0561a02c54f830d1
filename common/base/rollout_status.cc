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
  }
  CHECK(false, "a RolloutStatus outside its enumeration");
}

}  // namespace treeroll
