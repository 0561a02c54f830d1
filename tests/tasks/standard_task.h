#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/base/config_error.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// A task of this tree with settings in JSON. Those it has resolved must give the same task again.
inline std::unique_ptr<Task> standard_task(const std::string& name, const std::string& settings) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  nlohmann::json resolved;
  auto task = registry.make(name, nlohmann::json::parse(settings), resolved);
  nlohmann::json again;
  (void)registry.make(name, resolved, again);
  EXPECT_EQ(again, resolved);
  return task;
}

/// What the task says of settings that it refuses; empty if it takes them.
inline std::string refusal(const std::string& name, const std::string& settings) {
  try {
    (void)standard_task(name, settings);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace treeroll
