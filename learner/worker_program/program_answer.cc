#include "learner/worker_program/program_answer.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/json_text.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr int kNestingMax = 64;

}  // namespace

json read_program_answer(const std::string& output, const std::string& key_otherwise,
                         const std::string& unusable) {
  Result<json> said = parse_json(output, kNestingMax);
  if (!said || !said->is_object()) throw std::runtime_error(unusable);
  const auto error = said->find("error");
  if (error == said->end()) return *std::move(said);
  const auto text = [&](const char* name, const std::string& otherwise) -> std::string {
    if (!error->is_object()) throw std::runtime_error(unusable);
    const auto value = error->find(name);
    if (value == error->end()) return otherwise;
    if (!value->is_string()) throw std::runtime_error(unusable);
    return *value;
  };
  throw ConfigError(text("key", key_otherwise), text("value", ""), text("rule", "is refused"));
}

}  // namespace treeroll
