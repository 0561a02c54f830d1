#include "learner/core/dispatch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace treeroll {
namespace {

using protocol::WorkerId;

constexpr Duration kLeaseUnknown = std::chrono::seconds(1);
constexpr Duration kLeaseMin = std::chrono::milliseconds(10);
constexpr Duration kLeaseMax = std::chrono::hours(24);
/// A worker heard of within two of its slowest heartbeats is alive; the others get nothing until
/// they are heard again.
constexpr Duration kAlive = std::chrono::milliseconds(600);
/// Roll-outs queued at an evaluator cover this much of the network's delay, and of the time in
/// which a lost message is noticed and sent again.
constexpr double kCoveredDelaySeconds = 20e-3;
constexpr int kDepthMin = 2;
constexpr int kDepthMax = 64;
/// A request in the kernel's receive buffer, with its bookkeeping there.
constexpr int kRequestBytes = 1024;

bool knows(const WorkerEntry& worker, const Question& question) {
  return !worker.refused.contains(question.task_id) && !worker.refused.contains(question.policy_id);
}

/// Workers that are alive and have room, least loaded first.
class Candidates {
 public:
  Candidates(WorkerTable& workers, const DispatchFacts& facts)
      : now_(facts.now), rollout_time_s_(facts.rollout_time_s) {
    for (auto& [id, worker] : workers.all()) put(worker);
  }

  bool empty() {
    while (!heap_.empty() && is_stale(heap_.front())) {
      std::pop_heap(heap_.begin(), heap_.end(), Later{});
      heap_.pop_back();
    }
    return heap_.empty();
  }

  /// Precondition: !empty().
  WorkerEntry* least_loaded(const Question& question) const {
    if (knows(*heap_.front().worker, question)) return heap_.front().worker;
    const Candidate* least = nullptr;
    for (const Candidate& candidate : heap_) {
      if (is_stale(candidate) || !knows(*candidate.worker, question)) continue;
      if (!least || Later{}(*least, candidate)) least = &candidate;
    }
    return least ? least->worker : nullptr;
  }

  bool has_room(WorkerEntry& worker) const { return room(worker) > 0; }

  void give(WorkerEntry& worker, protocol::RolloutKey key) {
    worker.leases.insert(key);
    --worker.free_slots;
    put(worker);
  }

 private:
  struct Candidate {
    double load = 0;
    WorkerEntry* worker = nullptr;
  };
  /// Of two, the one to be asked later.
  struct Later {
    bool operator()(const Candidate& a, const Candidate& b) const {
      return std::pair(a.load, a.worker->id) > std::pair(b.load, b.worker->id);
    }
  };

  int room(const WorkerEntry& worker) const {
    if (!worker.usable() || worker.last_heard + kAlive <= now_) return 0;
    return std::min(window(worker, rollout_time_s_) - static_cast<int>(worker.leases.size()),
                    worker.free_slots);
  }
  static double load(const WorkerEntry& worker) {
    return static_cast<double>(worker.leases.size()) / worker.num_evaluators;
  }
  /// What has been given since stands once more, behind.
  static bool is_stale(const Candidate& candidate) {
    return candidate.load != load(*candidate.worker);
  }
  void put(WorkerEntry& worker) {
    if (room(worker) <= 0) return;
    heap_.push_back({load(worker), &worker});
    std::push_heap(heap_.begin(), heap_.end(), Later{});
  }

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
  const int wanted = worker.num_evaluators * std::min(depth, kDepthMax);
  const int fits = std::max(worker.num_evaluators, worker.receive_buffer_bytes / 2 / kRequestBytes);
  return std::min({wanted, fits, protocol::kLeasesPerWorkerMax});
}

Duration lease_duration(const WorkerEntry& worker, double rollout_time_s) {
  if (!worker.answer_time_s || rollout_time_s <= 0 || worker.num_evaluators == 0) {
    return kLeaseUnknown;
  }
  const double queued_s =
      rollout_time_s * static_cast<double>(worker.leases.size() + 1) / worker.num_evaluators;
  const double lease_s = 4 * std::max(*worker.answer_time_s, queued_s);
  if (lease_s >= to_seconds(kLeaseMax)) return kLeaseMax;
  return std::max(kLeaseMin,
                  std::chrono::duration_cast<Duration>(std::chrono::duration<double>(lease_s)));
}

std::vector<Ledger::Assignment> assign(const Ledger& ledger, WorkerTable& workers,
                                       const DispatchFacts& facts) {
  std::vector<Ledger::Assignment> chosen;
  if (ledger.ready().empty()) return chosen;
  Candidates candidates(workers, facts);
  for (std::size_t place = 0; place < ledger.ready().size() && !candidates.empty(); ++place) {
    const protocol::RolloutKey key = ledger.ready()[place];
    const Ledger::Entry& entry = *ledger.find(key);
    if (!facts.tasks->contains(entry.question.task_id)) continue;

    WorkerEntry* worker = workers.find(entry.last_worker);
    const bool stays = worker && knows(*worker, entry.question) && candidates.has_room(*worker);
    if (!stays) worker = candidates.least_loaded(entry.question);
    if (!worker) continue;
    candidates.give(*worker, key);
    chosen.push_back(
        {place, worker->id, facts.now + lease_duration(*worker, facts.rollout_time_s)});
  }
  return chosen;
}

}  // namespace treeroll
