#pragma once

#include <cstddef>

#include "workers/core/definition_cache.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// How many roll-outs an evaluator is given at once: this one and others like it. Only short ones
/// of a task that is repeatable, so that nobody waits long for an answer; not so many that another
/// evaluator would find none; and not more numbers than the socket has room for. At least 1.
/// @param task       of the roll-out
/// @param num_ready  others that wait for an evaluator
std::size_t num_together(const HeldRollout& held, const Definition& task, std::size_t num_ready,
                         const WorkerSettings& settings);

}  // namespace treeroll::worker
