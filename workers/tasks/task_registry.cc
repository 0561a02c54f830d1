#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "common/base/settings_reader.h"
#include "workers/tasks/task.h"

namespace treeroll {
namespace {

/// What a task says of itself is code, not input: a description that breaks the rules is a bug.
void check_description(const std::string& name, const TaskDescription& d) {
  CHECK(d.input_dim >= 1 && d.output_dim >= 1, "dimensions of task " + name);
  CHECK(std::isfinite(d.reward_max) && d.reward_min >= 0 && d.reward_min < d.reward_max,
        "reward range of task " + name);
  CHECK(std::isfinite(d.time_limit_s) && d.time_limit_s > 0, "time limit of task " + name);
}

}  // namespace

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
  check_description(name, task->description());
  return task;
}

}  // namespace treeroll
