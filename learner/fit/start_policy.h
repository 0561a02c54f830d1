#pragma once

#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"

namespace treeroll {

class SettingsReader;

/// A policy before exploration.
struct StartPolicy {
  TreeModel tree;
  ThetaLayout layout = ThetaLayout::kMeansCholesky;
};

/// Reads the [policy] table of a study and builds the policy it describes: demonstration, fit,
/// tree. Throws ConfigError. Does not call finish(): the caller does.
StartPolicy read_start_policy(SettingsReader& policy);

}  // namespace treeroll
