#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/base/task_description.h"
#include "learner/study/study_file.h"

namespace treeroll {

/// Asks a worker executable (`--describe-task`) about a task.
/// @param content  of the task, Condition::task_content
/// Throws ConfigError for a task it does not know ("task.name") and for settings the task refuses,
/// std::runtime_error if the executable cannot be asked.
TaskDescription describe_task(const std::string& content,
                              const std::filesystem::path& worker_program);

/// Asks the worker executable about every task of the study, so that a study is checked before
/// anything starts.
/// @param is_needed  else the executable may be missing or not know a task: that is left out, and
///                   described by remote workers over the bus
/// @return by task content
/// Throws StudyError for settings a task refuses and for a policy with other dimensions than its
/// task's; ConfigError if the executable is needed and cannot be run; std::runtime_error if it
/// answers with what cannot be read.
std::map<std::string, TaskDescription> survey_tasks(const LoadedStudy& loaded,
                                                    const std::filesystem::path& worker_program,
                                                    bool is_needed);

}  // namespace treeroll
