#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "workers/tasks/task.h"

namespace treeroll::worker {

/// Text of our own or of a user's task, as a message may carry it: UTF-8 without a NUL, cut to at
/// most `bytes_max` bytes.
std::string bounded(const std::string& text, std::size_t bytes_max);

/// With the reason so bounded.
Outcome failed(const std::string& reason);

/// Evaluates a policy with a task that may be anybody's: what it throws, a reward that is not
/// finite or outside the range it describes, is status kFailed with a reason. Reasons are bounded.
/// @param trace  receives the roll-out step by step; may be null
Outcome evaluate_checked(Task& task, const TaskDescription& description, Controller& controller,
                         std::uint64_t seed, Trace* trace);

/// The same of several, side by side. Nothing if the task throws or does not answer each: then they
/// are to be evaluated one by one.
std::optional<std::vector<Outcome>> evaluate_all_checked(
    Task& task, const TaskDescription& description, std::span<const Task::Evaluation> evaluations);

}  // namespace treeroll::worker
