#pragma once

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Reads the [policy] table of kind "rbf", radial functions:
///
///   kind = "rbf"
///   functions = "auto"      # of an output: as few as meet the demonstration within a tenth of its
///                           # rms, of several recordings their mean; or how many, from 2 on.
///                           # Without a demonstration 8
///   start = "fit"           # or "constant", with range and values as of a spline
///
/// Throw ConfigError. Do not call finish().
StartPolicy read_rbf_start(SettingsReader& policy, const StartSources& sources);

/// Of kind "dmp", movement primitives. An output begins where the demonstration does, which theta
/// does not change; its goal, which it does, is where the demonstration ends.
///
///   kind = "dmp"
///   weights = "auto"        # of an output, beside its goal; as `functions`. Without a
///                           # demonstration 10
///   start = "fit"
StartPolicy read_dmp_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
