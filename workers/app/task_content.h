#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "workers/tasks/task.h"

namespace treeroll::worker {

/// Makes a task from the content of a task definition (common/base/task_agreement.h).
/// Throws ConfigError with the key that is wrong; for one that makes something else of a resolved
/// content than the task that resolved it; for whatever else a task's constructor throws,
/// one that names the task.
/// @param resolved  receives the settings with their defaults
std::unique_ptr<Task> make_task(const TaskRegistry& registry, const std::string& content,
                                nlohmann::json& resolved);

/// Reads a task's name and settings from standard input and prints what it says of itself, or
/// what is wrong: {"description": ..., "settings": ...} or {"error": {"key", "value", "rule"}}.
/// @return  exit status: 0, or 2 for bad settings
int describe_task(const TaskRegistry& registry);

}  // namespace treeroll::worker
