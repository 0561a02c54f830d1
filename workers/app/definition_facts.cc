#include "workers/app/definition_facts.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/json_text.h"

namespace treeroll::worker {

using nlohmann::json;

std::string facts_text(const Policy& policy) {
  const json facts{{"input_dim", policy.input_dim()},
                   {"output_dim", policy.output_dim()},
                   {"theta_dim", policy.theta_dim()}};
  return facts.dump();
}

std::optional<DefinitionFacts> read_facts(DefinitionKind kind, const std::string& text) {
  constexpr int kNestingMax = 2;
  const Result<json> parsed = parse_json(text, kNestingMax);
  const json value = parsed ? *parsed : json();
  const auto integer = [&](const char* key, int& number) {
    if (!value.is_object() || !value.contains(key) || !value[key].is_number_integer()) return false;
    number = value[key].get<int>();
    return number >= 1;
  };
  DefinitionFacts facts;
  if (!integer("input_dim", facts.input_dim) || !integer("output_dim", facts.output_dim)) {
    return std::nullopt;
  }
  if (kind == DefinitionKind::kPolicy) {
    return integer("theta_dim", facts.theta_dim) ? std::optional(facts) : std::nullopt;
  }
  if (!value.contains("time_limit_s") || !value["time_limit_s"].is_number()) return std::nullopt;
  const double time_limit_s = value["time_limit_s"].get<double>();
  if (!(time_limit_s > 0 && time_limit_s <= 1e6)) return std::nullopt;
  facts.time_limit = std::chrono::nanoseconds(std::llround(time_limit_s * 1e9));
  return facts;
}

}  // namespace treeroll::worker
