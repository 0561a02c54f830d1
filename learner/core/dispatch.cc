#include "learner/core/dispatch.h"

#include <algorithm>
#include <cmath>
#include <set>
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

  bool empty() const { return by_load_.empty(); }

  WorkerEntry* least_loaded(const Question& question) {
    for (const auto& [load, worker] : by_load_) {
      if (knows(*worker, question)) return worker;
    }
    return nullptr;
  }

  bool has_room(WorkerEntry& worker) const { return room(worker) > 0; }

  void give(WorkerEntry& worker, protocol::RolloutKey key) {
    by_load_.erase({load(worker), &worker});
    worker.leases.insert(key);
    --worker.free_slots;
    put(worker);
  }

 private:
  struct Order {
    bool operator()(const std::pair<double, WorkerEntry*>& a,
                    const std::pair<double, WorkerEntry*>& b) const {
      return std::pair(a.first, a.second->id) < std::pair(b.first, b.second->id);
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
  void put(WorkerEntry& worker) {
    if (room(worker) > 0) by_load_.emplace(load(worker), &worker);
  }

  TimePoint now_;
  double rollout_time_s_;
  std::set<std::pair<double, WorkerEntry*>, Order> by_load_;
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
