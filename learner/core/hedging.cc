#include "learner/core/hedging.h"

#include <algorithm>

namespace treeroll::learner {
namespace {

/// Of the task's mean duration. Durations differ: a fall ends a swing-up early.
constexpr double kFarLonger = 4;
/// Below it a second evaluation costs more than the wait.
constexpr double kWaitMinS = 1;
/// Where nobody has answered yet: the first worker that was asked may never do so.
constexpr double kUnknownMaxS = 10;

/// Mean duration of its task; 0 while it is not known.
double task_time_s(const Ledger::Entry& entry, const DispatchFacts& facts) {
  const auto time = facts.task_times_s->find(entry.question.task_id);
  return time == facts.task_times_s->end() ? 0 : time->second;
}

/// An evaluator that nobody uses.
struct Idle {
  WorkerEntry* worker = nullptr;
  int num_evaluators = 0;
};

std::vector<Idle> idle_workers(const Ledger& ledger, WorkerTable& workers, TimePoint now) {
  std::vector<Idle> idle;
  for (auto& [id, worker] : workers.all()) {
    // Who has never answered anything stays late until it does.
    if (num_out(ledger, id) == 0 && worker.num_accepted > 0) worker.late = false;
    if (!worker.usable() || !worker.is_alive(now)) continue;
    const int num_idle = std::min(worker.evaluators_shown() - static_cast<int>(num_out(ledger, id)),
                                  worker.free_slots);
    if (num_idle > 0) idle.push_back({&worker, num_idle});
  }
  // Where all are doubtful one of them is asked: there is nobody else. First of all those who
  // have answered before: two that never do would hold a roll-out for ever.
  std::stable_sort(idle.begin(), idle.end(), [](const Idle& a, const Idle& b) {
    const auto rank = [](const WorkerEntry& worker) {
      return std::pair(!worker.is_first_choice(), worker.num_accepted == 0);
    };
    return rank(*a.worker) < rank(*b.worker);
  });
  return idle;
}

struct Late {
  protocol::RolloutKey key;
  TimePoint since;
  bool is_queued = false;
  protocol::WorkerId instead_of = 0;
};

/// What this worker has for too long.
void add_late(const Ledger& ledger, WorkerTable& workers, const WorkerEntry& worker,
              const DispatchFacts& facts, std::vector<Late>& late) {
  const auto has_answered = [&](const Ledger::Lease& lease) {
    const WorkerEntry* holder = workers.find(lease.worker);
    return holder != nullptr && holder->num_accepted > 0;
  };
  struct Held {
    std::int64_t batch = 0;
    protocol::RolloutKey key;
    auto operator<=>(const Held&) const = default;
  };
  std::vector<Held> row;  // as the worker takes them: first come, first served
  for (const protocol::RolloutKey key : ledger.leases_of(worker.id)) {
    row.push_back({ledger.find(key)->lease_of(worker.id)->batch, key});
  }
  std::sort(row.begin(), row.end());
  for (std::size_t place = 0; place < row.size(); ++place) {
    const Ledger::Entry& entry = *ledger.find(row[place].key);
    const bool is_twice = entry.leases.size() > 1;
    // Of two that never answer the older one is not waited for.
    if (is_twice && (entry.leases.front().worker != worker.id ||
                     std::ranges::any_of(entry.leases, has_answered))) {
      continue;
    }
    const auto task = facts.tasks->find(entry.question.task_id);
    if (task == facts.tasks->end() || !task->second.repeatable) continue;
    const TimePoint since = entry.leases.back().issued_at;
    const double out_s = to_seconds(facts.now - since);
    const double time_s = task_time_s(entry, facts);
    const double once_max_s = time_s > 0 ? std::max(kWaitMinS, kFarLonger * time_s) : kUnknownMaxS;
    const double held_max_s = is_twice ? kFarLonger * once_max_s : once_max_s;
    const bool is_queued = !is_twice && place >= static_cast<std::size_t>(worker.num_evaluators);
    const bool is_late = is_queued ? std::max(out_s, time_s) >= kWaitMinS : out_s >= held_max_s;
    if (is_late) late.push_back({row[place].key, since, is_queued, is_twice ? worker.id : 0});
  }
}

}  // namespace

std::vector<Hedge> hedges(const Ledger& ledger, WorkerTable& workers, const DispatchFacts& facts) {
  std::vector<Hedge> chosen;
  if (ledger.num_leased() == 0) return chosen;
  std::vector<Idle> idle = idle_workers(ledger, workers, facts.now);
  if (idle.empty()) return chosen;
  std::vector<Late> late;
  for (const auto& [id, worker] : workers.all()) add_late(ledger, workers, worker, facts, late);
  std::sort(late.begin(), late.end(), [](const Late& a, const Late& b) {
    return std::pair(a.since, a.key) < std::pair(b.since, b.key);
  });
  for (const Late& one : late) {
    const Ledger::Entry& entry = *ledger.find(one.key);
    const auto free = std::find_if(idle.begin(), idle.end(), [&](const Idle& each) {
      return each.num_evaluators > 0 && !entry.lease_of(each.worker->id) &&
             each.worker->may_have(entry.question);
    });
    if (free == idle.end()) continue;
    // An evaluator that takes for ever may be the first of many there.
    if (!one.is_queued) workers.find(entry.leases.front().worker)->late = true;
    --free->num_evaluators;
    --free->worker->free_slots;
    const double time_s = task_time_s(entry, facts);
    chosen.push_back(
        {one.key, free->worker->id,
         facts.now + lease_duration(*free->worker, num_out(ledger, free->worker->id), time_s),
         one.instead_of});
  }
  return chosen;
}

}  // namespace treeroll::learner
