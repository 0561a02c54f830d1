#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "common/policy/policy_registry.h"

namespace treeroll {

/// What becomes of the starts that were fitted before and that a resolved study holds.
enum class StoredStarts { kTaken, kFittedAgain };

/// What a resolved study holds beside its settings, so that it needs no other file and nobody fits
/// again. Each entry has the hash of its content for a name:
///
///   [demonstrations]
///   5d... = "t,x\n0,1\n..."    # CsvDemonstration::text; policy.demonstration.content names it
///
///   [starts.9a...]             # the hash of the [policy] table that the fit was made by
///   log_likelihoods = [-1.2]
///   policy = "{...}"           # common/policy/policy.h
class StudyStore {
 public:
  StudyStore();

  /// Takes the two tables over from a study file. Throws ConfigError on what is no such table.
  void read_demonstrations(const nlohmann::json& table);
  void read_starts(const nlohmann::json& table);

  /// Throws DemonstrationError if there is none of this content.
  const std::string& demonstration(const std::string& content) const;
  /// The start that was fitted by these settings, if it is here. Throws ConfigError on one that is
  /// no policy.
  std::optional<StartPolicy> start(const nlohmann::json& policy_settings,
                                   const PolicyRegistry& policies) const;

  /// Adds what the start of a condition needs. Nothing if it was not fitted.
  void keep(const nlohmann::json& policy_settings, const StartPolicy& start);

  /// Both tables as TOML; "" if they are empty.
  std::string to_toml() const;

 private:
  std::map<std::string, std::string> demonstrations_;  // by content
  std::shared_ptr<nlohmann::json> starts_;             // by the hash of the settings
};

}  // namespace treeroll
