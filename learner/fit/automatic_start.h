#pragma once

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Reads the [policy] table of kind "auto", in which a study says what there is and no more:
///
///   kind = "auto"
///   [policy.demonstration]  # of one input: a correction of it; a spline if it cannot be corrected
///                           # (several recordings, or a long one); of several inputs, or where
///                           # samples lack outputs: a network
///   start = "constant"      # or no demonstration, and
///   range = [0.0, 2.0]      # a spline of 8 over a time, with values as there; or
///   ranges = [[-1, 1], ..]  # a network of a state
///
/// Other keys are those of the kind that is chosen. Throws ConfigError. Does not call finish().
StartPolicy read_automatic_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
