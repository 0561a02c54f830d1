#include "workers/app/help_tasks.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/program/standard_output.h"
#include "common/settings/settings_reference.h"
#include "workers/app/json_answer.h"

namespace treeroll::worker {

void print_tasks(const TaskRegistry& registry, const std::string& pattern) {
  for (const std::string& name : registry.names()) {
    fmt::print("{}", reference_part(fmt::format("[task] name = \"{}\"", name),
                                    registry.settings(name), pattern));
  }
  flush_standard_output();
}

int print_task_example(const TaskRegistry& registry, const std::string& name) {
  const JsonAnswer answer;
  try {
    nlohmann::json settings = nlohmann::json::array();
    for (const KeyNote& note : registry.settings(name).plain) {
      const bool required = note.otherwise.empty();
      settings.push_back({{"key", note.key.substr(std::string("task.").size())},
                          {"value", required ? note.example : note.otherwise},
                          {"required", required},
                          {"meaning", note.meaning}});
    }
    return answer.give({{"settings", std::move(settings)}, {"start", registry.start(name)}});
  } catch (const ConfigError& error) {
    return answer.refuse(error);
  }
}

}  // namespace treeroll::worker
