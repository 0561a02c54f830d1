#pragma once

#include <cstdint>
#include <string>

#include "workers/tasks/task.h"

namespace treeroll::worker {

struct CheckedEvaluation {
  Outcome outcome;
  std::string complaint;  ///< what is wrong with the task; empty if nothing is
};

/// Evaluates a policy with a task that may be anybody's: what it throws, a reward that is not
/// finite or outside the range it describes, is status kFailed with a complaint.
/// @param trace  receives the roll-out step by step; may be null
CheckedEvaluation evaluate_checked(Task& task, const TaskDescription& description,
                                   Controller& controller, std::uint64_t seed, Trace* trace);

}  // namespace treeroll::worker
