#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "learner/core/run_record.h"

namespace treeroll::learner {

/// What a roll-out asks a worker, whoever that is. Its theta is here as well as with the run that
/// drew it: asking needs it until an answer is in, learning until that is applied, which in
/// sequence may be much later.
struct Question {
  ContentHash task_id;
  ContentHash policy_id;
  std::int64_t task_seed = 0;
  std::int64_t content = 0;  ///< short hash of the fields above and theta; echoed by answers
  Eigen::VectorXd theta;
  /// Contents of its earlier trials, whose seeds were others: discarded, each.
  std::vector<std::int64_t> discarded;
};

/// Sets `content`.
void seal(Question& question, protocol::RolloutKey key);

/// What `content` would be if the question were asked under this key.
std::int64_t content_under(const Question& question, protocol::RolloutKey key);

/// The book of every roll-out that has no answer yet: drawn -> ready -> leased -> answered, and
/// back from leased to ready when the lease is lost. Knows no learning and no worker but by name.
class Ledger {
 public:
  struct Lease {
    protocol::WorkerId worker = 0;
    std::int64_t batch = 0;  ///< sequence of the message that carried the request
    TimePoint issued_at;
    TimePoint deadline;
  };
  struct Entry {
    Question question;
    int attempt = 0;  ///< of the next issue
    std::optional<Lease> lease;
    protocol::WorkerId last_worker = 0;  ///< that held a lease and may have it yet; 0 none
  };

  /// A roll-out has been drawn, or is to be tried again. Precondition: its key is not open.
  void draw(protocol::RolloutKey key, Question question);

  /// Oldest first, re-issued ones before all others.
  const std::deque<protocol::RolloutKey>& ready() const { return ready_; }
  /// Leases the ready roll-outs at these places of ready(), given in ascending order.
  struct Assignment {
    std::size_t place = 0;
    protocol::WorkerId worker = 0;
    TimePoint deadline;
  };
  /// Carries the assignments out; the requests, in order, are for one or more batches whose
  /// sequence is told by set_batch() once they have one.
  std::vector<protocol::RolloutRequest> lease(TimePoint now, const std::vector<Assignment>& chosen);
  void set_batch(protocol::RolloutKey key, std::int64_t batch);

  /// Moves the end of a lease of this worker; nothing if it does not hold it.
  void extend(protocol::RolloutKey key, protocol::WorkerId worker, TimePoint deadline);
  /// Takes a lease back: the roll-out is ready again. Precondition: it is leased.
  void take_back(protocol::RolloutKey key);
  /// The same where the holder says that it has neither the question nor its answer: nothing
  /// speaks for asking the same one again.
  void take_back_lost(protocol::RolloutKey key);
  /// Takes back what this worker has.
  void take_back_all(protocol::WorkerId worker);
  /// Takes back every lease whose deadline is not after `now`; the keys.
  std::vector<protocol::RolloutKey> expire(TimePoint now);
  std::optional<TimePoint> next_deadline() const;

  /// What is leased to this worker. Valid until the next change of the ledger.
  const std::set<protocol::RolloutKey>& leases_of(protocol::WorkerId worker) const;
  /// The open question of a key, or nothing.
  const Entry* find(protocol::RolloutKey key) const;
  /// An answer has been accepted: the entry goes. Precondition: find(key).
  Entry close(protocol::RolloutKey key);

  std::size_t num_leased() const { return deadlines_.size(); }

  /// What the ledger sees of them: not applied, pending and failed, which only runs know.
  LedgerCounters counters;

 private:
  void index(protocol::RolloutKey key, const Lease& lease);
  void drop_from_indices(protocol::RolloutKey key, const Lease& lease);

  std::map<protocol::RolloutKey, Entry> entries_;
  std::deque<protocol::RolloutKey> ready_;
  // The leases of entries_ once more, in the order of their deadlines and by worker: timers and
  // heartbeats come often, and no walk over all that is open is made for one.
  std::set<std::pair<TimePoint, protocol::RolloutKey>> deadlines_;
  std::map<protocol::WorkerId, std::set<protocol::RolloutKey>> leases_;
};

}  // namespace treeroll::learner
