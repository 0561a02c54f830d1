#include "learner/core/task_facts.h"

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/settings_reader.h"

namespace treeroll {

Result<TaskFacts> task_facts_from_json(std::string_view text) {
  constexpr int kDimMax = 1024;
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return Error{"the description of a task is not JSON"};
  nlohmann::json resolved;
  try {
    SettingsReader reader(json, "description", resolved);
    TaskFacts facts;
    facts.input_dim = static_cast<int>(reader.integer("input_dim", 1, kDimMax));
    facts.output_dim = static_cast<int>(reader.integer("output_dim", 1, kDimMax));
    facts.reward_min = reader.number("reward_min", kNotNegative);
    facts.reward_max = reader.number("reward_max", NumberRule{.min = facts.reward_min});
    facts.time_limit_s = reader.number("time_limit_s", kPositive);
    facts.deterministic = reader.boolean("deterministic");
    reader.finish();
    return facts;
  } catch (const ConfigError& error) {
    return Error{error.what()};
  }
}

}  // namespace treeroll
