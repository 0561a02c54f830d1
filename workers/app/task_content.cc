#include "workers/app/task_content.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/task_facts/task_agreement.h"
#include "workers/app/evaluated_task.h"
#include "workers/app/floating_point.h"
#include "workers/app/json_answer.h"
#include "workers/app/json_request.h"
#include "workers/user_program/user_program.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

constexpr std::size_t kInputBytesMax = 1U << 20U;

/// A task of one's own may describe itself by what its settings say: what contradicts itself is an
/// answer, as a bad setting is.
void check(const TaskDescription& description, const std::string& name) {
  const auto require = [&](bool condition, const std::string& rule) {
    if (!condition) throw ConfigError("task", '"' + name + '"', "describes " + rule);
  };
  const auto is_dim = [](int dim) { return dim >= 1 && dim <= kTaskDimMax; };
  require(is_dim(description.input_dim) && is_dim(description.output_dim),
          fmt::format("{} inputs and {} outputs: must be from 1 to {} each", description.input_dim,
                      description.output_dim, kTaskDimMax));
  require(std::isfinite(description.reward_max) && description.reward_min >= 0 &&
              description.reward_min <= description.reward_max,
          fmt::format("rewards from {} to {}: must be a finite range that is not negative",
                      description.reward_min, description.reward_max));
  require(description.time_limit_s > 0 && description.time_limit_s <= kTaskTimeLimitSMax,
          fmt::format("a time limit of {} s: must be above 0 and at most {:.0f} s",
                      description.time_limit_s, kTaskTimeLimitSMax));
  require(description.version.size() <= kTaskVersionBytesMax,
          fmt::format("a version of {} bytes: must have at most {}", description.version.size(),
                      kTaskVersionBytesMax));
  const auto fault = fault_of(description.signals, description.input_dim, description.output_dim);
  require(!fault, "its signals, " + fault.value_or(""));
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

TaskDescription resolve_task(const std::string& content, json& resolved,
                             const Describer& describe) {
  const json value = parse(content);
  const auto name = value["name"].get<std::string>();
  const StandardFloatingPoint standard;
  try {
    const TaskDescription description = describe(name, value["settings"], resolved);
    check(description, name);
    check_agreement(value, resolved, description);
    return description;
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& error) {
    throw ConfigError("task.name", '"' + name + '"',
                      std::string("must be a task that can be made; it says: ") + error.what());
  }
}

std::unique_ptr<Task> make_task(const TaskRegistry& registry, const std::string& content,
                                json& resolved) {
  std::unique_ptr<Task> task;
  resolve_task(content, resolved, [&](const std::string& name, const json& settings, json& found) {
    task = registry.make(name, settings, found);
    return task->description();
  });
  return task;
}

int describe_task(const TaskSourceMaker& start) {
  const JsonAnswer answer;
  try {
    const std::unique_ptr<TaskSource> tasks = start();
    json resolved;
    const std::unique_ptr<EvaluatedTask> task =
        tasks->make(read_standard_input("task", kInputBytesMax), resolved);
    return answer.give(
        {{"description", to_json_with_signals(task->description())}, {"settings", resolved}});
  } catch (const ConfigError& error) {
    return answer.refuse(error);
  } catch (const ProgramEnded& ended) {
    return answer.refuse(ConfigError("--evaluator", "", "must take a task: " + ended.what));
  }
}

}  // namespace treeroll::worker
