#include "learner/core/task_facts.h"

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/base/settings_reader.h"

namespace treeroll {

Result<TaskFacts> task_facts_from_json(std::string_view text) {
  constexpr int kDimMax = 1024;
  constexpr int kNestingMax = 2;
  const Result<nlohmann::json> json = parse_json(text, kNestingMax);
  if (!json) return Error{"the description of a task " + json.error().message};
  nlohmann::json resolved;
  try {
    SettingsReader reader(*json, "description", resolved);
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
