#pragma once

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Reads the [policy] table of kind "ds_gmr". Its attractor is a tree, and has all keys of one
/// (start_policy.h):
///
///   kind = "ds_gmr"
///   stiffness = 1600        # kp, 1/s^2; (88 / duration)^2 by default
///
/// The attractor is fitted to u + (u'' + kv u') / kp of the demonstration u, which is to be smooth:
/// of one input, the time. A recording ends where the time does not rise, or leaves a gap of more
/// than five median steps; files whose times go on from one to the next are one recording. One that
/// does not begin at rest makes a movement that begins beside it, by (u'' + kv u') / kp.
/// components = "auto" and the log-likelihoods speak of the attractor. With start = "components":
///
///   range = [0.0, 2.2]      # when the movement begins and ends
///
/// Throws ConfigError. Does not call finish().
StartPolicy read_ds_gmr_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
