#include "learner/study/policy_cache.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/config_error.h"
#include "common/base/content_hash.h"
#include "common/policy/policy_bounds.h"
#include "common/settings/settings_reader.h"
#include "learner/study/demonstration_file.h"
#include "learner/study/study_table.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// The table of [policy] that counts for a given policy as well.
constexpr const char* kBounds = "bounds";

}  // namespace

PolicyCache::PolicyCache(const PolicyRegistry& registry, const StudyStore& stored,
                         StoredStarts starts, int form)
    : registry_(registry), stored_(stored), starts_(starts), form_(form) {}

const ResolvedPolicy& PolicyCache::get(const json& settings) {
  const std::string key = settings.dump();
  const auto found = policies_.find(key);
  if (found != policies_.end()) return found->second;
  return policies_.emplace(key, read(settings)).first->second;
}

/// A policy given as text takes the place of the one that the other settings describe. Those are
/// checked all the same, but not kept.
ResolvedPolicy PolicyCache::read(json settings) const {
  std::optional<ResolvedPolicy> given;
  if (settings.contains(kGivenPolicy)) {
    given = read_given(settings);
    for (const char* counts : {kGivenPolicy, kBounds}) settings.erase(counts);
    if (settings.empty()) return *given;
  }
  json resolved;
  SettingsReader reader(settings, "policy", resolved);
  std::optional<StartPolicy> fitted;
  if (starts_ == StoredStarts::kTaken) fitted = stored_.start(settings, registry_);
  StartPolicy start = registry_.read_start(
      reader, {.form = form_,
               .read_file = read_demonstration_file,
               .find_demonstration =
                   [this](const std::string& content) { return stored_.demonstration(content); },
               .fitted = fitted ? &*fitted : nullptr});
  reader.finish();
  if (given) return *given;
  if (!start.demonstration_text.empty()) {
    // Where the data came from decides nothing: what they are stands in the study. A study of
    // form 1 names them by the bytes of their files, which the store does not.
    json& demonstration = resolved["demonstration"];
    demonstration.erase("files");
    demonstration.erase("align");
    demonstration["content"] = to_hex(content_hash(start.demonstration_text));
  }
  return {.start = std::move(start), .settings = std::make_shared<json>(std::move(resolved))};
}

ResolvedPolicy PolicyCache::read_given(const json& settings) const {
  json resolved;
  SettingsReader reader(settings, "policy", resolved);
  Result<NamedPolicy> named = registry_.named_from_json(*read_given_policy(reader));
  if (!named) throw ConfigError("policy.given", "", named.error().message);
  ResolvedPolicy given{.start = {.policy = std::move(named->policy)},
                       .settings = std::make_shared<json>(std::move(resolved)),
                       .signals = std::move(named->signals)};
  if (!reader.has(kBounds)) return given;
  // Of all that stands beside a given policy these count: they are part of it from now on.
  PolicyPtr& start = given.start.policy;
  start = without_bounds(start);
  start = bounded(start, read_policy_bounds(reader.table(kBounds), start));
  given.settings = std::make_shared<json>(json{{kGivenPolicy, to_json(*start, given.signals)}});
  return given;
}

}  // namespace treeroll
