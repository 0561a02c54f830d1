#include "learner/core/dispatch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

using protocol::WorkerId;

constexpr Duration kLeaseUnknown = std::chrono::seconds(1);
constexpr Duration kLeaseMax = std::chrono::hours(24);
/// Roll-outs queued at an evaluator cover this much of the network's delay, and of the time in
/// which a lost message is noticed and sent again.
constexpr double kCoveredDelaySeconds = 40e-3;
/// More than any window: the others come first.
constexpr double kLoadOfSecondChoice = 1e6;
/// Of who is no new witness: the others come first, but those of second choice.
constexpr double kLoadOfKnownWitness = 1e5;
constexpr int kDepthMin = 2;
constexpr int kDepthMax = 64;
/// A request in the kernel's receive buffer, with its bookkeeping there.
constexpr int kRequestBytes = 1024;

/// A worker and what it has, including what has just been chosen for it.
struct Seat {
  WorkerEntry* worker = nullptr;
  std::size_t num_out = 0;
};

/// Workers that are alive and have room, least loaded first, those that lose leases or are late
/// last.
class Candidates {
 public:
  Candidates(const Ledger& ledger, WorkerTable& workers, const DispatchFacts& facts)
      : now_(facts.now), rollout_time_s_(facts.rollout_time_s) {
    seats_.reserve(workers.all().size());
    // Both are in the order of their ids: thousands of workers are walked, not looked for.
    auto share = ledger.shares().begin();
    for (auto& [id, worker] : workers.all()) {
      while (share != ledger.shares().end() && share->first < id) ++share;
      const bool has_some = share != ledger.shares().end() && share->first == id;
      seats_.push_back({&worker, has_some ? share->second.size() : 0});
      put(seats_.back());
    }
  }

  bool empty() {
    while (!heap_.empty() && is_stale(heap_.front())) {
      std::pop_heap(heap_.begin(), heap_.end(), Later{});
      heap_.pop_back();
    }
    return heap_.empty();
  }

  /// Precondition: !empty(). Null if all have refused a definition.
  Seat* least_loaded(const Question& question) const {
    Seat* front = heap_.front().seat;
    if (may_have(*front, question) && front->worker->is_new_witness(question)) return front;
    Candidate least;
    for (const Candidate& candidate : heap_) {
      if (is_stale(candidate) || !may_have(*candidate.seat, question)) continue;
      const bool is_new = candidate.seat->worker->is_new_witness(question);
      const Candidate one{candidate.load + (is_new ? 0 : kLoadOfKnownWitness), candidate.seat};
      if (!least.seat || Later{}(least, one)) least = one;
    }
    return least.seat;
  }

  /// Of this worker, if it may have this one too; else null.
  Seat* seat_with_room(protocol::WorkerId id, const Question& question) {
    const auto found = std::lower_bound(
        seats_.begin(), seats_.end(), id,
        [](const Seat& seat, protocol::WorkerId wanted) { return seat.worker->id < wanted; });
    if (found == seats_.end() || found->worker->id != id) return nullptr;
    if (!found->worker->is_first_choice()) return nullptr;
    return room(*found) > 0 && may_have(*found, question) ? &*found : nullptr;
  }

  void give(Seat& seat) {
    ++seat.num_out;
    --seat.worker->free_slots;
    put(seat);
  }

 private:
  struct Candidate {
    double load = 0;
    Seat* seat = nullptr;
  };
  /// Of two, the one to be asked later.
  struct Later {
    bool operator()(const Candidate& a, const Candidate& b) const {
      return std::pair(a.load, a.seat->worker->id) > std::pair(b.load, b.seat->worker->id);
    }
  };

  static bool may_have(const Seat& seat, const Question& question) {
    return seat.worker->may_have(question);
  }
  int room(const Seat& seat) const {
    const WorkerEntry& worker = *seat.worker;
    if (!worker.usable() || !worker.is_alive(now_)) return 0;
    const int share = worker.hearing.share_of(window(worker, rollout_time_s_));
    return std::min(share - static_cast<int>(seat.num_out), worker.free_slots);
  }
  static double load(const Seat& seat) {
    const double load = static_cast<double>(seat.num_out) / seat.worker->evaluators_shown();
    return seat.worker->is_first_choice() ? load : load + kLoadOfSecondChoice;
  }
  /// What has been given since stands once more, behind.
  static bool is_stale(const Candidate& candidate) {
    return candidate.load != load(*candidate.seat);
  }
  void put(Seat& seat) {
    if (room(seat) <= 0) return;
    heap_.push_back({load(seat), &seat});
    std::push_heap(heap_.begin(), heap_.end(), Later{});
  }

  std::vector<Seat> seats_;  // by id of the worker, all; none moves
  TimePoint now_;
  double rollout_time_s_;
  std::vector<Candidate> heap_;
};

}  // namespace

int window(const WorkerEntry& worker, double rollout_time_s) {
  int depth = kDepthMin;
  if (rollout_time_s > 0) {
    depth += static_cast<int>(std::min<double>(kDepthMax, kCoveredDelaySeconds / rollout_time_s));
  }
  const int num_evaluators = worker.evaluators_shown();
  const int wanted = num_evaluators * std::min(depth, kDepthMax);
  const int fits = std::max(num_evaluators, worker.receive_buffer_bytes / 2 / kRequestBytes);
  return std::min({wanted, fits, protocol::kLeasesPerWorkerMax});
}

Duration lease_duration(const WorkerEntry& worker, std::size_t num_leased, double rollout_time_s) {
  if (!worker.answer_time_s || rollout_time_s <= 0 || worker.num_evaluators == 0) {
    return kLeaseUnknown;
  }
  const double queued_s =
      rollout_time_s * static_cast<double>(num_leased + 1) / worker.num_evaluators;
  const double lease_s = protocol::kLeasePerWork * std::max(*worker.answer_time_s, queued_s);
  if (lease_s >= to_seconds(kLeaseMax)) return kLeaseMax;
  return std::max(protocol::kLeaseMin,
                  std::chrono::duration_cast<Duration>(std::chrono::duration<double>(lease_s)));
}

std::size_t num_out(const Ledger& ledger, protocol::WorkerId worker) {
  return ledger.share_of(worker).size();
}

std::vector<Ledger::Assignment> assign(const Ledger& ledger, WorkerTable& workers,
                                       const DispatchFacts& facts) {
  std::vector<Ledger::Assignment> chosen;
  if (ledger.ready().empty()) return chosen;
  Candidates candidates(ledger, workers, facts);
  for (std::size_t place = 0; place < ledger.ready().size() && !candidates.empty(); ++place) {
    const protocol::RolloutKey key = ledger.ready()[place];
    const Ledger::Entry& entry = *ledger.find(key);
    const auto task = facts.tasks->find(entry.question.task_id);
    if (task == facts.tasks->end()) continue;
    if (entry.question.is_run_again() && !may_run_again(task->second)) continue;

    Seat* seat = candidates.seat_with_room(entry.last_worker, entry.question);
    if (!seat) seat = candidates.least_loaded(entry.question);
    if (!seat) continue;
    candidates.give(*seat);
    chosen.push_back(
        {place, seat->worker->id,
         facts.now + lease_duration(*seat->worker, seat->num_out, facts.rollout_time_s)});
  }
  return chosen;
}

}  // namespace treeroll::learner
