#include "learner/study/task_table.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "common/settings/settings_reader.h"
#include "common/task_facts/task_agreement.h"
#include "learner/study/message_sizes.h"
#include "learner/study/study_file.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// What a task has said of itself, beside its settings in a resolved study.
constexpr const char* kDescribed = "described";

}  // namespace

std::string read_task_name(SettingsReader& reader) {
  std::string name = reader.string(
      "name", {},
      {.meaning = "A task that a worker knows; the other keys of [task] are the task's own"});
  if (name.empty()) reader.refuse("name", "must not be empty");
  return name;
}

TaskTable read_task_table(const json& table) {
  json scratch;
  SettingsReader reader(table, "task", scratch);
  const std::string name = read_task_name(reader);
  json task_settings = table;
  task_settings.erase("name");
  task_settings.erase(kDescribed);
  if (!table.contains(kDescribed)) return {task_content(name, task_settings, nullptr), {}};
  const Result<TaskDescription> described = task_description_from_json(table[kDescribed].dump());
  if (!described) throw ConfigError("task.described", "", described.error().message);
  return {task_content(name, task_settings, &*described), described->signals};
}

void forget_description(const SettingOrigins& origins, json& table) {
  for (auto i = origins.lower_bound("task"); i != origins.end() && i->first.starts_with("task");
       ++i) {
    if (i->second == kCommandLineOrigin) table.erase(kDescribed);
  }
}

void resolve_task(LoadedStudy& loaded, std::size_t condition, const std::string& settings,
                  const TaskDescription& description) {
  Condition& resolved = loaded.study.conditions.at(condition);
  json& task = loaded.resolved.conditions.at(condition)->at("task");
  const auto name = task.at("name").get<std::string>();
  task = json::parse(settings);
  resolved.task_content = task_content(name, task, &description);
  if (!description.signals.empty()) {
    resolved.signals = description.signals;
    loaded.columns.at(condition) = all_of(description.signals);
  }
  try {
    check_message_sizes(resolved);
  } catch (const ConfigError& error) {
    throw condition_error(loaded, condition, error);
  }
  task["name"] = name;
  task[kDescribed] = to_json_with_signals(description);
}

std::string unresolved_condition(const LoadedStudy& loaded) {
  for (const auto& condition : loaded.resolved.conditions) {
    if (!condition->at("task").contains(kDescribed)) return condition->at("name");
  }
  return "";
}

}  // namespace treeroll
