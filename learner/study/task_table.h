#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/task_facts/task_description.h"
#include "learner/study/study_error.h"

/// The [task] table of a condition: the task's name, its settings as they were given and, in a
/// resolved study, with the defaults that the task has for the others, and beside them what it has
/// said of itself, [task.described].
namespace treeroll {

struct LoadedStudy;
class SettingsReader;

/// The one key of [task] that is not the task's own. Throws ConfigError.
std::string read_task_name(SettingsReader& task);

struct TaskTable {
  std::string content;  ///< Condition::task_content
  SignalNames signals;  ///< of a resolved study: what the task calls inputs and outputs
};
/// Throws ConfigError.
TaskTable read_task_table(const nlohmann::json& table);

/// A task that the command line changes is to be described anew.
void forget_description(const SettingOrigins& origins, nlohmann::json& table);

/// Gives a condition what its task makes of the settings, defaults included, and says of itself:
/// from now on a worker whose task comes to anything else is refused (check_agreement()). What it
/// calls inputs and outputs is kept beside.
/// Throws StudyError if that is too large for a message.
/// @param settings  a JSON object, as `--describe-task` prints it
void resolve_task(LoadedStudy& loaded, std::size_t condition, const std::string& settings,
                  const TaskDescription& description);

/// The first condition whose task nobody has resolved: the study holds its settings as they were
/// given, and what they come to is up to the workers. Empty: there is none.
std::string unresolved_condition(const LoadedStudy& loaded);

}  // namespace treeroll
