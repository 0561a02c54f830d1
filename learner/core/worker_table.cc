#include "learner/core/worker_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace treeroll::learner {
namespace {

WorkerRecord record_of(const WorkerEntry& worker, TimePoint start) {
  WorkerRecord record;
  record.host = worker.host;
  record.pid = worker.pid;
  record.num_evaluators = worker.num_evaluators;
  record.num_accepted = worker.num_accepted;
  record.first_heard_s = to_seconds(worker.first_heard - start);
  record.last_heard_s = to_seconds(worker.last_heard - start);
  return record;
}

}  // namespace

std::string describe(const WorkerEntry& worker) {
  return fmt::format("worker {} ({} pid {})", worker.id, worker.host, worker.pid);
}

WorkerEntry* WorkerTable::hear(protocol::WorkerId id, TimePoint now) {
  auto found = workers_.find(id);
  if (found == workers_.end()) {
    put_out_a_stranger();
    if (is_full()) return nullptr;
    WorkerEntry entry;
    entry.id = id;
    entry.first_heard = now;
    if (const auto left = left_.find(id); left != left_.end()) {
      // It was only silent: what it has done and what has been acknowledged still hold.
      // An answer may come before its next heartbeat, and is one of its class.
      entry.host = left->second.host;
      entry.pid = left->second.pid;
      entry.numeric_class = left->second.numeric_class;
      entry.noted_class = left->second.noted_class;
      entry.other_class = left->second.other_class;
      entry.first_heard = left->second.first_heard;
      entry.num_accepted = left->second.num_accepted;
      entry.results_read = left->second.results_read;
      entry.last_index_settled = left->second.last_index_settled;
      entry.distrusted = left->second.distrusted;
      entry.trusted_again = left->second.trusted_again;
      entry.num_distrusts = left->second.num_distrusts;
      entry.asked = left->second.asked;
      left_.erase(left);
    }
    newcomers_.push_back(id);
    found = workers_.emplace(id, std::move(entry)).first;
    found->second.alive_for = heartbeats_.alive;
    const TimePoint silence = now + heartbeats_.silence;
    if (!look_at_ || silence < *look_at_) look_at_ = silence;
  }
  found->second.last_heard = now;
  return &found->second;
      entry.set_aside = left->second.set_aside;
}

/// Thousands of names cost nothing to make up, and would keep all workers out. So one that has not
/// answered a greeting makes room, the first heard first: who is a worker answers at once.
void WorkerTable::put_out_a_stranger() {
  const auto is_stranger = [this](protocol::WorkerId id) {
    const auto found = workers_.find(id);
    return found != workers_.end() && !found->second.has_shown_itself();
  };
  while (is_full() && !newcomers_.empty()) {
    const protocol::WorkerId id = newcomers_.front();
    newcomers_.pop_front();
    if (is_stranger(id)) workers_.erase(id);
  }
  if (newcomers_.size() < 2 * protocol::kWorkersMax) return;
  std::erase_if(newcomers_, [&](protocol::WorkerId id) { return !is_stranger(id); });
}

WorkerEntry* WorkerTable::find(protocol::WorkerId id) {
  const auto found = workers_.find(id);
  return found == workers_.end() ? nullptr : &found->second;
}

void WorkerTable::note_told(TimePoint now, int num_workers) {
  constexpr int kShrinkInverse = 16;  // a third is left when a worker takes its learner for gone
  const int least = num_told_ - (num_told_ + kShrinkInverse - 1) / kShrinkInverse;
  const int num_told = std::max(num_workers, least);
  if (num_told == num_told_) return;
  num_told_ = num_told;
  const Duration silence_before = heartbeats_.silence;
  heartbeats_ = protocol::heartbeats_of(num_told);
  for (auto& [id, worker] : workers_) worker.alive_for = heartbeats_.alive;
  if (heartbeats_.silence < silence_before && look_at_) look_at_ = now;
}

std::vector<WorkerEntry> WorkerTable::remove_silent(TimePoint now) {
  std::vector<WorkerEntry> silent;
  if (!look_at_ || now < *look_at_) return silent;
  look_at_.reset();
  for (auto worker = workers_.begin(); worker != workers_.end();) {
    const TimePoint silence = worker->second.last_heard + heartbeats_.silence;
    if (silence > now) {
      if (!look_at_ || silence < *look_at_) look_at_ = silence;
      ++worker;
      continue;
    }
    silent.push_back(worker->second);
    worker->second.joined = false;
    make_room_among_those_that_left();
    worker->second.refused.clear();
    left_.insert(workers_.extract(worker++));
  }
  return silent;
}

/// Who has done least goes first, then who has been away longest: so thousands of made-up workers
/// do not push out the record of one that has worked.
void WorkerTable::make_room_among_those_that_left() {
  if (left_.size() < protocol::kWorkersMax) return;
  left_.erase(std::min_element(left_.begin(), left_.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second.num_accepted, a.second.last_heard) <
           std::pair(b.second.num_accepted, b.second.last_heard);
  }));
}

void WorkerTable::forget_refusals(TimePoint now) {
  for (auto& [id, worker] : workers_) {
    std::erase_if(worker.refused, [now](const auto& entry) { return entry.second.until <= now; });
  }
}

std::vector<const WorkerEntry*> WorkerTable::trust_again(TimePoint now) {
  std::vector<const WorkerEntry*> trusted;
  for (auto& [id, worker] : workers_) {
    if (!worker.distrusted || now < worker.trusted_again) continue;
    worker.distrusted = false;
    trusted.push_back(&worker);
  }
  return trusted;
}

int WorkerTable::num_joined() const {
  return static_cast<int>(std::count_if(workers_.begin(), workers_.end(),
                                        [](const auto& entry) { return entry.second.joined; }));
}

int WorkerTable::num_evaluators() const {
  int sum = 0;
  for (const auto& [id, worker] : workers_) sum += worker.joined ? worker.num_evaluators : 0;
  return sum;
}

std::vector<WorkerRecord> WorkerTable::records(TimePoint start) const {
  std::vector<WorkerRecord> records;
  for (const auto* workers : {&left_, &workers_}) {
    for (const auto& [id, worker] : *workers) records.push_back(record_of(worker, start));
  }
  return records;
}

}  // namespace treeroll::learner
