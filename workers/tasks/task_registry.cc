#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "common/settings/settings_reference.h"
#include "workers/tasks/task.h"

namespace treeroll {

void TaskRegistry::add(std::string name, TaskFactory factory, std::string start) {
  CHECK(!name.empty() && !tasks_.contains(name), "a task's name is new: " + name);
  tasks_.emplace(std::move(name), Known{std::move(factory), std::move(start)});
}

const TaskRegistry::Known& TaskRegistry::find(const std::string& name) const {
  const auto found = tasks_.find(name);
  if (found != tasks_.end()) return found->second;
  throw ConfigError("task.name", fmt::format("\"{}\"", name),
                    fmt::format("must be a task this worker knows: {}", fmt::join(names(), ", ")));
}

std::unique_ptr<Task> TaskRegistry::make(const std::string& name, const nlohmann::json& settings,
                                         nlohmann::json& resolved) const {
  const Known& known = find(name);
  resolved = nlohmann::json::object();
  SettingsReader reader(settings, "task", resolved);
  std::unique_ptr<Task> task = known.make(reader);
  reader.finish();
  return task;
}

void TaskRegistry::depends_on(const std::string& word, std::function<std::string()> is_here) {
  dependences_.emplace_back(word, std::move(is_here));
}

std::string TaskRegistry::numeric_suffix() const {
  std::string suffix;
  for (const auto& [word, is_here] : dependences_) suffix += " " + word + " " + is_here();
  return suffix;
}

std::vector<std::string> TaskRegistry::names() const {
  std::vector<std::string> names;
  for (const auto& [name, known] : tasks_) names.push_back(name);
  return names;
}

SettingsReference TaskRegistry::settings(const std::string& name) const {
  const Known& known = find(name);
  return list_settings("task", [&](SettingsReader& reader) { known.make(reader); });
}

const std::string& TaskRegistry::start(const std::string& name) const { return find(name).start; }

}  // namespace treeroll
