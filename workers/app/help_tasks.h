#pragma once

#include <string>

#include "workers/tasks/task.h"

namespace treeroll::worker {

/// Prints the settings of each task that fit the pattern (settings_reference.h), as Markdown.
void print_tasks(const TaskRegistry& registry, const std::string& pattern);

/// Prints what a new study needs of a task, as JSON:
///   {"settings": [{"key", "value", "required", "meaning"}, ..], "start": TOML}
/// of its settings those that do not depend on others, each with its default, or with an example
/// where it is required; or {"error": ..} as describe_task().
/// @return  exit status: 0, or 2 for a task that is not known
int print_task_example(const TaskRegistry& registry, const std::string& name);

}  // namespace treeroll::worker
