#include "common/task_facts/task_description.h"

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/settings/settings_reader.h"

namespace treeroll {

nlohmann::json to_json(const TaskDescription& description) {
  nlohmann::json object{
      {"input_dim", description.input_dim},       {"output_dim", description.output_dim},
      {"reward_min", description.reward_min},     {"reward_max", description.reward_max},
      {"time_limit_s", description.time_limit_s}, {"deterministic", description.deterministic}};
  if (!description.repeatable) object["repeatable"] = false;
  if (!description.version.empty()) object["version"] = description.version;
  return object;
}

nlohmann::json to_json_with_signals(const TaskDescription& description) {
  nlohmann::json object = to_json(description);
  if (description.signals.empty()) return object;
  object["inputs"] = description.signals.inputs;
  object["outputs"] = description.signals.outputs;
  return object;
}

std::string report_text(const TaskDescription& description) {
  std::string text = to_json_with_signals(description).dump();
  return text.size() <= kTaskReportBytesMax ? text : to_json(description).dump();
}

Result<TaskDescription> task_description_from_json(std::string_view text) {
  constexpr int kNestingMax = 2;
  const Result<nlohmann::json> json = parse_json(text, kNestingMax);
  if (!json) return Error{"the description of a task " + json.error().message};
  nlohmann::json resolved;
  try {
    SettingsReader reader(*json, "description", resolved);
    TaskDescription description;
    description.input_dim = static_cast<int>(reader.integer("input_dim", 1, kTaskDimMax));
    description.output_dim = static_cast<int>(reader.integer("output_dim", 1, kTaskDimMax));
    description.reward_min = reader.number("reward_min", kNotNegative);
    description.reward_max = reader.number("reward_max", NumberRule{.min = description.reward_min});
    description.time_limit_s = reader.number(
        "time_limit_s", NumberRule{.min = 0, .max = kTaskTimeLimitSMax, .min_allowed = false});
    description.deterministic = reader.boolean("deterministic");
    description.repeatable = reader.boolean("repeatable", true);
    description.version = reader.string("version", "");
    if (description.version.size() > kTaskVersionBytesMax) {
      reader.refuse("version", "must have at most 128 bytes");
    }
    if (reader.has("inputs")) description.signals.inputs = reader.strings("inputs", kSignalsMax);
    if (reader.has("outputs")) description.signals.outputs = reader.strings("outputs", kSignalsMax);
    if (const auto fault =
            fault_of(description.signals, description.input_dim, description.output_dim)) {
      throw ConfigError("description", "", *fault);
    }
    reader.finish();
    return description;
  } catch (const ConfigError& error) {
    return Error{error.what()};
  }
}

}  // namespace treeroll
