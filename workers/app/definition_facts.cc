#include "workers/app/definition_facts.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/json_text.h"
#include "common/task_facts/task_description.h"

namespace treeroll::worker {

using nlohmann::json;

std::string facts_text(const Policy& policy) {
  const json facts{{"input_dim", policy.input_dim()},
                   {"output_dim", policy.output_dim()},
                   {"theta_dim", policy.theta_dim()}};
  return facts.dump();
}

std::optional<DefinitionFacts> read_facts(DefinitionKind kind, const std::string& text) {
  if (kind == DefinitionKind::kTask) {
    const Result<TaskDescription> task = task_description_from_json(text);
    if (!task) return std::nullopt;
    return DefinitionFacts{
        .input_dim = task->input_dim,
        .output_dim = task->output_dim,
        .time_limit = std::chrono::nanoseconds(std::llround(task->time_limit_s * 1e9)),
        .repeatable = task->repeatable};
  }
  constexpr int kNestingMax = 2;
  const Result<json> value = parse_json(text, kNestingMax);
  const auto integer = [&](const char* key, int& number) {
    if (!value || !value->is_object() || !value->contains(key)) return false;
    const json& found = value->at(key);
    if (!found.is_number_integer()) return false;
    number = found.get<int>();
    return number >= 1;
  };
  DefinitionFacts facts;
  const bool complete = integer("input_dim", facts.input_dim) &&
                        integer("output_dim", facts.output_dim) &&
                        integer("theta_dim", facts.theta_dim);
  return complete ? std::optional(facts) : std::nullopt;
}

}  // namespace treeroll::worker
