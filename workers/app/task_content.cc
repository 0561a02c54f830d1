#include "workers/app/task_content.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/base/task_agreement.h"
#include "workers/app/json_answer.h"
#include "workers/app/json_request.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

constexpr std::size_t kInputBytesMax = 1U << 20U;

void check(const TaskDescription& description, const std::string& name) {
  const auto require = [&](bool condition, const char* rule) {
    if (!condition) throw ConfigError("task.name", '"' + name + '"', rule);
  };
  require(description.input_dim >= 1 && description.output_dim >= 1,
          "must be a task that describes at least one input and one output");
  require(description.input_dim <= kTaskDimMax && description.output_dim <= kTaskDimMax,
          "must be a task that describes at most 1024 inputs and 1024 outputs");
  require(std::isfinite(description.reward_max) && description.reward_min >= 0 &&
              description.reward_min <= description.reward_max,
          "must be a task that describes a finite reward range that is not negative");
  require(std::isfinite(description.time_limit_s) && description.time_limit_s > 0 &&
              description.time_limit_s <= kTaskTimeLimitSMax,
          "must be a task that describes a time limit above 0 and of at most a million seconds");
  require(description.version.size() <= kTaskVersionBytesMax,
          "must be a task that describes a version of at most 128 bytes");
}

json parse(const std::string& content) {
  Result<json> parsed = parse_json(content, kRequestNestingMax);
  if (!parsed) throw ConfigError("task", shown(content), parsed.error().message);
  json value = std::move(*parsed);
  const std::size_t num_described = value.is_object() ? value.count("described") : 0;
  if (!value.is_object() || value.size() != 2 + num_described || !value.contains("name") ||
      !value.contains("settings")) {
    throw ConfigError("task", shown(content),
                      R"(must be a JSON object {"name": ..., "settings": {...}})");
  }
  if (!value["name"].is_string()) {
    throw ConfigError("task.name", value["name"].dump(), "must be a string");
  }
  if (!value["settings"].is_object()) {
    throw ConfigError("task.settings", value["settings"].dump(), "must be an object");
  }
  return value;
}

}  // namespace

std::unique_ptr<Task> make_task(const TaskRegistry& registry, const std::string& content,
                                json& resolved) {
  const json value = parse(content);
  const auto name = value["name"].get<std::string>();
  try {
    std::unique_ptr<Task> task = registry.make(name, value["settings"], resolved);
    const TaskDescription description = task->description();
    check(description, name);
    check_agreement(value, resolved, description);
    return task;
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& error) {
    throw ConfigError("task.name", '"' + name + '"',
                      std::string("must be a task that can be made; it says: ") + error.what());
  }
}

int describe_task(const TaskRegistry& registry) {
  const JsonAnswer answer;
  try {
    json resolved;
    const std::unique_ptr<Task> task =
        make_task(registry, read_standard_input("task", kInputBytesMax), resolved);
    return answer.give({{"description", to_json(task->description())}, {"settings", resolved}});
  } catch (const ConfigError& error) {
    return answer.refuse(error);
  }
}

}  // namespace treeroll::worker
