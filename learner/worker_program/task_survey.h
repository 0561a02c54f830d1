#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "common/task_facts/task_description.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// What a worker executable says of a task.
struct DescribedTask {
  TaskDescription description;
  std::string settings;  ///< a JSON object: those of the content, and the task's defaults
};

/// Asks a worker executable (`--describe-task`) about a task.
/// @param content  of the task, Condition::task_content
/// Throws ConfigError for a task it does not know ("task.name"), for settings the task refuses, and
/// for a task that makes something else of a resolved content (check_agreement());
/// std::runtime_error if the executable cannot be asked.
DescribedTask describe_task(const std::string& content, const WorkerProgram& worker_program);

/// The same of a task that may be run unasked, only so that a roll-out is seen. Nothing for one
/// that says repeatable = false: it may be a robot, which would move, maybe amid a trial. Where the
/// content has that already, nothing is started at all.
std::optional<TaskDescription> describe_repeatable(const std::string& content,
                                                   const WorkerProgram& worker_program);

/// Asks the worker executable about every task of the study, so that a study is checked before
/// anything starts.
/// @param is_needed  else the executable may be missing or not know a task: that is left out, and
///                   described by remote workers over the bus
/// @return by task content
/// Throws StudyError for settings a task refuses and for a policy with other dimensions than its
/// task's; ConfigError if the executable is needed and cannot be run; std::runtime_error if it
/// answers with what cannot be read.
std::map<std::string, DescribedTask> survey_tasks(const LoadedStudy& loaded,
                                                  const WorkerProgram& worker_program,
                                                  bool is_needed);

/// Of a new study: resolves the tasks that have been described, so that what their settings came to
/// is part of the study.
/// @return the descriptions by task content, for LearnerSettings::known_tasks
/// Throws StudyError on settings that a study file cannot hold.
std::map<std::string, TaskDescription> resolve_tasks(
    LoadedStudy& loaded, const std::map<std::string, DescribedTask>& described);

/// The same of a study that goes on: its tasks stand as they are.
std::map<std::string, TaskDescription> descriptions_of(
    const std::map<std::string, DescribedTask>& described);

}  // namespace treeroll
