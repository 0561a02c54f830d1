#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "workers/app/evaluated_task.h"
#include "workers/tasks/task.h"

namespace treeroll::worker {

/// Has a task described by whoever knows it: `found` receives the settings with their defaults.
using Describer = std::function<TaskDescription(
    const std::string& name, const nlohmann::json& settings, nlohmann::json& found)>;

/// Reads the content of a task definition and checks what the describer makes of it; throws as
/// make_task() does.
/// @param resolved  receives the settings with their defaults
TaskDescription resolve_task(const std::string& content, nlohmann::json& resolved,
                             const Describer& describe);

/// Makes a task from the content of a task definition (common/task_facts/task_agreement.h).
/// Throws ConfigError with the key that is wrong; for one that makes something else of a resolved
/// content than the task that resolved it; for whatever else a task's constructor throws,
/// one that names the task.
/// @param resolved  receives the settings with their defaults
std::unique_ptr<Task> make_task(const TaskRegistry& registry, const std::string& content,
                                nlohmann::json& resolved);

/// Reads a task's name and settings from standard input and prints what it says of itself, or
/// what is wrong: {"description": ..., "settings": ...} or {"error": {"key", "value", "rule"}}.
/// @return  exit status: 0, or 2 for bad settings and a user's program that cannot be started
int describe_task(const TaskSourceMaker& start);

}  // namespace treeroll::worker
