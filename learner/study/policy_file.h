#pragma once

#include <filesystem>
#include <string>

#include "common/policy/policy_registry.h"

namespace treeroll {

/// A policy as a file holds it, policies/CONDITION-REPETITION.json of a state directory say.
struct PolicyFile {
  std::string text;  ///< the JSON of common/policy/policy.h
  PolicyPtr policy;
  SignalNames signals;  ///< what the text calls inputs and outputs, if it does
};

/// Throws ConfigError about `key` on what is not a regular, readable file of at most 1 MiB that
/// holds a policy.
/// @param key  of the setting or argument that names the file
PolicyFile read_policy_file(const std::string& key, const std::filesystem::path& path,
                            const PolicyRegistry& policies);

}  // namespace treeroll
