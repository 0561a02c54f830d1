#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "common/task_facts/task_description.h"

/// What the learner sends of a task, its content, is a JSON object:
///
///   {"name": ..., "settings": {...}}                      as a study file gives them
///   {"name": ..., "settings": {...}, "described": {...}}  resolved: with the task's defaults, and
///                                                         what it said of itself (TaskDescription)
///
/// A study is a function of its file alone only if all who evaluate it make the same of the second.
namespace treeroll {

/// A content, keys sorted, so that equal tasks have equal text.
/// @param settings   a JSON object
/// @param described  null as long as nobody has resolved the settings
std::string task_content(const std::string& name, const nlohmann::json& settings,
                         const TaskDescription* described);

/// What a task has said of itself, as a content holds it; nothing if it is not resolved.
std::optional<TaskDescription> described_in(const std::string& content);

/// Throws ConfigError, naming the key and both values, if a content is resolved and a task makes
/// anything else of it: other defaults, a setting more or less, another description or version.
/// @param content      a JSON object as above
/// @param settings     what the task has made of its settings
/// @param description  what it says of itself
void check_agreement(const nlohmann::json& content, const nlohmann::json& settings,
                     const TaskDescription& description);

/// The same of two descriptions of one task: what differs, for a person; nothing if they agree.
/// Whoever calls the signals otherwise has them in another order, or means others: its rewards are
/// those of another task. Who names none agrees with all.
std::optional<std::string> disagreement(const TaskDescription& expected,
                                        const TaskDescription& found);

}  // namespace treeroll
