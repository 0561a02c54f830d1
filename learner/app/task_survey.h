#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "learner/core/study.h"
#include "learner/core/task_facts.h"

namespace treeroll {

/// Asks a worker executable (`--describe-task`) about every task of the study, so that a study is
/// checked before anything starts. A task whose name the executable does not know is left out:
/// remote workers may know it, and describe it over the bus.
/// @return by task content
/// Throws ConfigError for settings the task refuses and for a description that cannot be used;
/// std::runtime_error if the executable cannot be asked.
std::map<std::string, TaskFacts> survey_tasks(const Study& study,
                                              const std::filesystem::path& worker_program);

}  // namespace treeroll
