#include "learner/study/study_store.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/csv_demonstration.h"
#include "learner/study/toml_source.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kLayersMax = 64;

std::string start_name(const json& policy_settings) {
  return to_hex(content_hash(policy_settings.dump()));
}

}  // namespace

StudyStore::StudyStore() : starts_(std::make_shared<json>(json::object())) {}

void StudyStore::read_demonstrations(const json& table) {
  for (const auto& [content, text] : table.items()) {
    if (!text.is_string()) {
      throw ConfigError("demonstrations." + content, "", "must be the text of a demonstration");
    }
    demonstrations_[content] = text.get<std::string>();
  }
}

void StudyStore::read_starts(const json& table) {
  for (const auto& [name, start] : table.items()) {
    if (!start.is_object()) throw ConfigError("starts." + name, "", "must be a table");
  }
  starts_ = std::make_shared<json>(table);
}

const std::string& StudyStore::demonstration(const std::string& content) const {
  const auto found = demonstrations_.find(content);
  if (found != demonstrations_.end()) return found->second;
  throw DemonstrationError(
      "is no entry of the study's [demonstrations]; name the files that hold it");
}

std::optional<StartPolicy> StudyStore::start(const json& policy_settings,
                                             const PolicyRegistry& policies) const {
  const std::string name = start_name(policy_settings);
  const auto found = starts_->find(name);
  if (found == starts_->end()) return std::nullopt;
  json resolved;
  SettingsReader reader(*found, "starts." + name, resolved);
  StartPolicy start;
  start.log_likelihoods = reader.numbers("log_likelihoods", kAnyNumber, 0, kLayersMax);
  Result<PolicyPtr> policy = policies.from_json(reader.string("policy"));
  if (!policy) throw ConfigError("starts." + name + ".policy", "", policy.error().message);
  reader.finish();
  start.policy = *std::move(policy);
  return start;
}

void StudyStore::keep(const json& policy_settings, const StartPolicy& start) {
  if (!start.demonstration) return;
  const std::string name = start_name(policy_settings);
  if (starts_->contains(name)) return;  // conditions often share a start
  if (!start.demonstration_text.empty()) {
    demonstrations_[to_hex(content_hash(start.demonstration_text))] = start.demonstration_text;
  }
  (*starts_)[name] = {{"log_likelihoods", start.log_likelihoods},
                      {"policy", to_json(*start.policy)}};
}

std::string StudyStore::to_toml() const {
  std::string text;
  if (!demonstrations_.empty()) append_toml(json{{"demonstrations", demonstrations_}}, "", text);
  if (!starts_->empty()) append_toml(json{{"starts", *starts_}}, "", text);
  return text;
}

}  // namespace treeroll
