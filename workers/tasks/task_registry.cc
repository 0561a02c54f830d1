#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/task.h"

namespace treeroll {

void TaskRegistry::add(std::string name, TaskFactory factory) {
  CHECK(!name.empty() && !factories_.contains(name), "a task's name is new: " + name);
  factories_.emplace(std::move(name), std::move(factory));
}

std::unique_ptr<Task> TaskRegistry::make(const std::string& name, const nlohmann::json& settings,
                                         nlohmann::json& resolved) const {
  const auto found = factories_.find(name);
  if (found == factories_.end()) {
    std::vector<std::string> known;
    for (const auto& [known_name, factory] : factories_) known.push_back(known_name);
    throw ConfigError("task.name", fmt::format("\"{}\"", name),
                      fmt::format("must be a task this worker knows: {}", fmt::join(known, ", ")));
  }
  resolved = nlohmann::json::object();
  SettingsReader reader(settings, "task", resolved);
  std::unique_ptr<Task> task = found->second(reader);
  reader.finish();
  return task;
}

}  // namespace treeroll
