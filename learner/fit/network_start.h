#pragma once

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Reads the [policy] table of kind "network":
///
///   kind = "network"
///   hidden = 5              # units, 1 to 64
///   seed = 1                # of the numbers that a start draws
///   start = "fit"           # to [policy.demonstration], of any number of inputs; or "constant":
///   ranges = [[-0.3, 0.3], [-1.5, 1.5]]   # where each input is expected
///   values = [0.0]          # what each output begins with
///
/// A fit goes downhill from up to 20 starts that are drawn (Nguyen and Widrow 1990), and keeps the
/// best. A constant start is the first of them with a = 0. Throws ConfigError. Does not call
/// finish().
StartPolicy read_network_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
