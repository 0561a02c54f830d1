#pragma once

#include <cstddef>

#include "workers/core/definition_cache.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// How many roll-outs an evaluator is given at once, in one packet, which it answers with one: this
/// one and others of its task. Only short ones of a task that is repeatable, so that nobody waits
/// long for an answer; half of an evaluator's share of what is held, rounded up, so that another
/// one finds as much while answers are on their way. At least 1.
/// @param task      of the roll-out
/// @param num_held  roll-outs, those of evaluators too
std::size_t num_together(const HeldRollout& held, const Definition& task, std::size_t num_held,
                         const WorkerSettings& settings);

}  // namespace treeroll::worker
