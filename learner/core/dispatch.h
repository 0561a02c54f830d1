#pragma once

#include <map>
#include <vector>

#include "common/base/time.h"
#include "common/task_facts/task_description.h"
#include "learner/core/ledger.h"
#include "learner/core/worker_table.h"

namespace treeroll::learner {

/// What dispatching needs to know beside the ledger and the workers.
struct DispatchFacts {
  TimePoint now;
  double rollout_time_s = 0;  ///< running mean over all answers; 0 while none is known
  /// Tasks whose description is known; the others wait.
  const std::map<ContentHash, TaskDescription>* tasks = nullptr;
  /// Running mean of each task's roll-outs, once one has been answered.
  const std::map<ContentHash, double>* task_times_s = nullptr;
};

/// Whether a second answer tells anything, and asking for it does no harm.
inline bool may_run_again(const TaskDescription& task) {
  return task.deterministic && task.repeatable;
}

/// How many roll-outs may be at a worker at once: enough that no evaluator waits for the network,
/// no more than its receive buffer holds.
int window(const WorkerEntry& worker, double rollout_time_s);

/// How long a roll-out may stay with a worker without word: max(10 ms, 4 x (queued work + round
/// trip)); 1 s while no duration is known.
/// @param num_leased  what it has already
Duration lease_duration(const WorkerEntry& worker, std::size_t num_leased, double rollout_time_s);

/// How many roll-outs it has of ours as far as is known, copies of answered ones among them.
std::size_t num_out(const Ledger& ledger, protocol::WorkerId worker);

/// Who gets which of the ready roll-outs: the least loaded worker that is alive, hears, has room
/// and has not refused the definitions; one that has lost leases or is late only if no other has
/// room. A re-issued one goes back to the worker that had it while nothing speaks against that
/// worker, because it may hold it already or have the answer in its store. Of those who are no
/// second choice one of another host and key than those who have answered it comes first. Reduces
/// `free_slots` in `workers`; the leases are for Ledger::lease() to note.
std::vector<Ledger::Assignment> assign(const Ledger& ledger, WorkerTable& workers,
                                       const DispatchFacts& facts);

}  // namespace treeroll::learner
