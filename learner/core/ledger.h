#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "learner/core/known_worker.h"
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
  /// Who has answered it, as the journal knows them. Not empty: it has its result, and one more
  /// worker is to answer it.
  std::vector<KnownWorker> answered_by = {};

  bool is_run_again() const { return !answered_by.empty(); }
  bool was_answered_by(protocol::WorkerId worker) const;
};

/// Sets `content`.
void seal(Question& question, protocol::RolloutKey key);

/// What `content` would be if the question were asked under this key.
std::int64_t content_under(const Question& question, protocol::RolloutKey key);

/// The book of every roll-out that has no answer yet: drawn -> ready -> leased -> answered, and
/// back from leased to ready when the lease is lost. A roll-out may be leased to a second worker
/// too: then it is ready when both leases are lost. Knows no learning and no worker but by name.
class Ledger {
 public:
  struct Lease {
    protocol::WorkerId worker = 0;
    std::int64_t batch = 0;  ///< sequence of the message that carried the request
    TimePoint issued_at;
    TimePoint deadline;
    bool confirmed = false;  ///< its worker has said that it holds the roll-out
  };
  static constexpr std::size_t kLeasesMax = 2;
  struct Entry {
    Question question;
    int attempt = 0;                     ///< of the next issue
    std::vector<Lease> leases;           ///< at most kLeasesMax, of as many workers; none: ready
    protocol::WorkerId last_worker = 0;  ///< that held a lease and may have it yet; 0 none
    /// Who has ever had a lease of it: nobody else can have its answer.
    std::vector<protocol::WorkerId> asked;

    /// Null if this worker has none.
    const Lease* lease_of(protocol::WorkerId worker) const;
    bool was_asked(protocol::WorkerId worker) const;
  };

  /// A roll-out has been drawn, or is to be tried again, or run again by one more worker.
  /// Precondition: its key is not open.
  /// @param asked  who has had a lease of it, and may answer it
  void draw(protocol::RolloutKey key, Question question,
            std::vector<protocol::WorkerId> asked = {});

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
  /// Leases it to a second worker. Precondition: it is leased to one other worker.
  protocol::RolloutRequest lease_too(TimePoint now, protocol::RolloutKey key,
                                     protocol::WorkerId worker, TimePoint deadline);
  void set_batch(protocol::RolloutKey key, protocol::WorkerId worker, std::int64_t batch);

  /// The holder says that it has it: moves the end of its lease. Whether it says so for the first
  /// time. Precondition: the worker has a lease of it.
  bool confirm(protocol::RolloutKey key, protocol::WorkerId worker, TimePoint deadline);
  /// Takes a lease back: the roll-out is ready again unless another worker has one. Precondition:
  /// the worker has a lease of it.
  void take_back(protocol::RolloutKey key, protocol::WorkerId worker);
  /// The same where the holder says that it has neither the question nor its answer: nothing
  /// speaks for asking the same one again.
  void take_back_lost(protocol::RolloutKey key, protocol::WorkerId worker);
  /// Takes back what this worker has, or only what it has never said it holds.
  void take_back_all(protocol::WorkerId worker);
  void take_back_unconfirmed(protocol::WorkerId worker);
  /// Takes back every lease whose deadline is not after `now`; as they were.
  struct Expired {
    protocol::RolloutKey key;
    Lease lease;
  };
  std::vector<Expired> expire(TimePoint now);
  std::optional<TimePoint> next_deadline() const;

  /// What a worker has of ours, as far as is known.
  struct Share {
    std::set<protocol::RolloutKey> leases;
    /// What it may be busy with although it has been answered: key, and the batch that asked.
    std::map<protocol::RolloutKey, std::int64_t> copies;

    std::size_t size() const { return leases.size() + copies.size(); }
  };
  /// Of those who have something. Valid until the next change of the ledger, as what follows is.
  const std::map<protocol::WorkerId, Share>& shares() const { return shares_; }
  const Share& share_of(protocol::WorkerId worker) const;
  const std::set<protocol::RolloutKey>& leases_of(protocol::WorkerId worker) const {
    return share_of(worker).leases;
  }
  const std::map<protocol::RolloutKey, std::int64_t>& copies_at(protocol::WorkerId worker) const {
    return share_of(worker).copies;
  }
  /// The open question of a key, or nothing.
  const Entry* find(protocol::RolloutKey key) const;
  /// An answer has been accepted: the entry goes. Precondition: find(key).
  /// @param from  whose answer it was: another worker that has a lease keeps a copy
  Entry close(protocol::RolloutKey key, protocol::WorkerId from = 0);

  void forget_copy(protocol::RolloutKey key, protocol::WorkerId worker);

  std::size_t num_leased() const { return entries_.size() - ready_.size(); }

  /// What the ledger sees of them: not applied, pending and failed, which only runs know.
  LedgerCounters counters;

 private:
  protocol::RolloutRequest add_lease(TimePoint now, protocol::RolloutKey key, Entry& entry,
                                     protocol::WorkerId worker, TimePoint deadline);
  void drop_from_indices(protocol::RolloutKey key, const Lease& lease);
  template <class Change>
  void change_share(protocol::WorkerId worker, const Change& change);

  std::map<protocol::RolloutKey, Entry> entries_;
  std::deque<protocol::RolloutKey> ready_;
  // The leases of entries_ once more, in the order of their deadlines and by worker: timers and
  // heartbeats come often, and no walk over all that is open is made for one.
  std::set<std::tuple<TimePoint, protocol::RolloutKey, protocol::WorkerId>> deadlines_;
  std::map<protocol::WorkerId, Share> shares_;
};

}  // namespace treeroll::learner
