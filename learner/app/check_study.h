#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Says what a study would do and starts none of it: its runs and roll-outs, the sizes of theta,
/// the reward of each condition's start policy (evaluated once), about how long it takes, and the
/// settings that nobody has given. Throws as run_learner() does for a study that cannot be run.
void check_study(const LearnerOptions& options);

}  // namespace treeroll
