#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace treeroll {

/// How a roll-out ended. Everything but kOk has reward 0, and a roll-out that ends so has failed.
enum class RolloutStatus : std::int8_t {
  kOk = 0,
  kDiverged = 1,  ///< the simulation left the finite numbers or its own bounds
  kFailed = 2,    ///< the task could not evaluate this policy, for a reason of its own
  kCrashed = 3,   ///< several evaluators exited or died by a fatal signal under it
  kTimedOut = 4,  ///< it ended several evaluators by exceeding the task's time limit
  /// The task says that the trial is void and is to be made again; a roll-out ends so that was
  /// discarded more often than its study allows.
  kDiscarded = 5,
};
inline constexpr int kNumRolloutStatuses = 6;

/// Lower-case word for tables and logs: ok, diverged, failed, crashed, timed_out,
/// discarded.
std::string_view name(RolloutStatus status);
/// The status of such a word, or nothing.
std::optional<RolloutStatus> rollout_status(std::string_view name);

}  // namespace treeroll
