#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "learner/app/study_file.h"
#include "learner/core/task_facts.h"

namespace treeroll {

/// Asks a worker executable (`--describe-task`) about a task.
/// @param content  of the task, Condition::task_content
/// @return         nothing if the executable does not know the task's name
/// Throws ConfigError for settings the task refuses, std::runtime_error if the executable cannot
/// be asked.
std::optional<TaskFacts> describe_task(const std::string& content,
                                       const std::filesystem::path& worker_program);

/// Asks a worker executable about every task of the study, so that a study is
/// checked before anything starts. A task whose name the executable does not know is left out:
/// remote workers may know it, and describe it over the bus.
/// @return by task content
/// Throws StudyError for settings a task refuses and for a policy with other dimensions than its
/// task's; std::runtime_error if the executable cannot be asked.
std::map<std::string, TaskFacts> survey_tasks(const LoadedStudy& loaded,
                                              const std::filesystem::path& worker_program);

}  // namespace treeroll
