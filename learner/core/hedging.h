#pragma once

#include <vector>

#include "learner/core/dispatch.h"

namespace treeroll::learner {

/// A roll-out that one worker has and another is to be given too.
struct Hedge {
  protocol::RolloutKey key;
  protocol::WorkerId worker = 0;
  TimePoint deadline;
  /// Whose lease it takes over; 0: nobody's, it is one more.
  protocol::WorkerId instead_of = 0;
};

/// Which leased roll-outs idle evaluators are given too, the oldest first: those that are held far
/// longer than their task takes, and those that only wait in a worker's queue for as long as it is
/// worth a message. Only of tasks that may be started twice, and each to one more worker; where two
/// hold it who have never answered anything, in place of one of them. Reduces `free_slots` and
/// marks who is late; the leases are for Ledger::lease_too() to note.
std::vector<Hedge> hedges(const Ledger& ledger, WorkerTable& workers, const DispatchFacts& facts);

}  // namespace treeroll::learner
