#pragma once

#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"
#include "learner/explore/exploration.h"

namespace treeroll {

class SettingsReader;

/// Reads the [exploration] table of a study for a given start policy (number of layers, size of
/// theta for one component). `num_rollouts` and `in_flight` are the study's and stay untouched.
/// Throws ConfigError. Does not call finish(): the caller does.
ExplorationSettings read_exploration_settings(SettingsReader& exploration, const TreeModel& start,
                                              ThetaLayout layout);

}  // namespace treeroll
