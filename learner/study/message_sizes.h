#pragma once

#include "learner/core/study.h"

namespace treeroll {

/// Throws ConfigError (key policy or task) if a condition's roll-outs could ever need a message
/// that is too large to be sent, with the size: its task, the policy at any explored layer with
/// every number at its longest, its theta.
void check_message_sizes(const Condition& condition);

}  // namespace treeroll
