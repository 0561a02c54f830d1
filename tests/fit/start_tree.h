#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/base/config_error.h"
#include "common/policy/policy_registry.h"
#include "common/policy/tree/tree_policy.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/start_policy.h"

namespace treeroll {

/// What a study begins with, known to be a tree.
inline const TreePolicy& tree_policy(const Policy& policy) {
  return dynamic_cast<const TreePolicy&>(policy);
}
inline const TreePolicy& tree_policy(const StartPolicy& start) {
  return tree_policy(*start.policy);
}
inline const TreeModel& tree_of(const StartPolicy& start) { return tree_policy(start).tree(); }

/// The tree that a study begins with whose [policy] table is this, as JSON.
/// @param resolved_out  takes the table with all that was left open; may be null
inline StartPolicy read_start_tree(const std::string& text,
                                   nlohmann::json* resolved_out = nullptr) {
  const nlohmann::json table = nlohmann::json::parse(text);
  nlohmann::json resolved;
  SettingsReader reader(table, "policy", resolved);
  StartPolicy policy = read_start_policy(reader);
  reader.finish();
  if (resolved_out) *resolved_out = resolved;
  return policy;
}

/// "" if it is not refused.
inline std::string refusal_of_start_tree(const std::string& text) {
  try {
    read_start_tree(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace treeroll
