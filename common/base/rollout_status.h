#pragma once

#include <cstdint>
#include <string_view>

namespace treeroll {

/// How a roll-out ended. Everything but kOk counts as failed and has reward 0.
enum class RolloutStatus : std::int8_t {
  kOk = 0,
  kDiverged = 1,  ///< the simulation left the finite numbers or its own bounds
  kFailed = 2,    ///< the task could not evaluate this policy, for a reason of its own
  kCrashed = 3,   ///< it ended several evaluators by a fatal signal of its own
  kTimedOut = 4,  ///< it ended several evaluators by exceeding the task's time limit
};
inline constexpr int kNumRolloutStatuses = 5;

/// Lower-case word for tables and logs: ok, diverged, failed, crashed, timed_out.
std::string_view name(RolloutStatus status);

}  // namespace treeroll
