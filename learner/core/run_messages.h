#pragma once

#include <vector>

#include "common/protocol/messages.h"
#include "learner/core/run.h"

namespace treeroll::learner {

/// What watchers are told of a run as it is now.
protocol::RunStatus run_status(const Run& run, const Study& study, protocol::LearnerId learner);

/// The best policy of a run so far, a message for each piece of it; none while its theta makes none
/// (Run::best_policy()). Precondition: a result has been applied.
std::vector<protocol::BestPolicy> best_policy(const Run& run, const Study& study,
                                              protocol::LearnerId learner);

}  // namespace treeroll::learner
