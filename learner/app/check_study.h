#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Says what a study would do: its runs and roll-outs, the sizes of theta, the reward of each
/// condition's start policy, about how long it takes, and the settings that nobody has given.
/// Starts none of it but each start policy, once, and none whose task is not repeatable. Throws as
/// run_learner() does for a study that cannot be run.
void check_study(const LearnerOptions& options);

}  // namespace treeroll
