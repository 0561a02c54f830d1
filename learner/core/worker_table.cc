#include "learner/core/worker_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/cut_text.h"

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

/// A worker that has answered nothing for so long makes room for another one, one in each pause: of
/// more workers than there may be none is to push out the next for ever.
constexpr Duration kAnswerDue = std::chrono::seconds(60);
constexpr Duration kPutOutPause = std::chrono::milliseconds(100);

}  // namespace

bool WorkerEntry::is_new_witness(const Question& question) const {
  return std::ranges::none_of(question.answered_by, [this](const KnownWorker& one) {
    return are_one_witness(one.worker_id, one.host, id, host);
  });
}

KnownWorker WorkerEntry::as_known() const {
  return {id, numeric_class, cut_text(host, protocol::kHostNameBytesMax), pid};
}

std::string describe(const WorkerEntry& worker) {
  return fmt::format("worker {} ({} pid {})", worker.id, worker.host, worker.pid);
}

WorkerEntry* WorkerTable::hear(protocol::WorkerId id, TimePoint now) {
  auto found = workers_.find(id);
  if (found == workers_.end()) {
    put_out_a_stranger(now);
    const auto of_key = num_of_key_.find(protocol::key_part(id));
    const bool has_too_many =
        has_keys_ && of_key != num_of_key_.end() && of_key->second >= protocol::kWorkersOfOneKeyMax;
    if (is_full() || has_too_many) return nullptr;
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
      entry.refused = left->second.refused;
      entry.described = left->second.described;
      left_.erase(left);
    }
    newcomers_.push_back(id);
    ++num_of_key_[protocol::key_part(id)];
    found = workers_.emplace(id, std::move(entry)).first;
    found->second.alive_for = heartbeats_.alive;
    const TimePoint silence = now + heartbeats_.silence;
    if (!look_at_ || silence < *look_at_) look_at_ = silence;
  }
  found->second.last_heard = now;
  return &found->second;
}

/// Thousands of names cost nothing to make up, and would keep all workers out. So one that has not
/// answered a greeting makes room, the first heard first: who is a worker answers at once. Then,
/// now and then, one that has answered nothing else for long: greetings can be heard by all. A
/// worker that is put out comes back with its next word.
void WorkerTable::put_out_a_stranger(TimePoint now) {
  const auto entry_of = [this](protocol::WorkerId id) -> const WorkerEntry* {
    const auto found = workers_.find(id);
    return found == workers_.end() || found->second.num_accepted > 0 ? nullptr : &found->second;
  };
  while (is_full() && !newcomers_.empty()) {
    const protocol::WorkerId id = newcomers_.front();
    newcomers_.pop_front();
    const WorkerEntry* entry = entry_of(id);
    if (entry == nullptr) continue;
    entry->has_answered_a_greeting() ? greeted_.push_back(id) : put_out(id);
  }
  while (is_full() && !greeted_.empty() && now >= next_put_out_) {
    const WorkerEntry* entry = entry_of(greeted_.front());
    if (entry != nullptr && now < entry->first_heard + kAnswerDue) break;  // the others are younger
    if (entry != nullptr) {
      put_out(greeted_.front());
      next_put_out_ = now + kPutOutPause;
    }
    greeted_.pop_front();
  }
  for (std::deque<protocol::WorkerId>* row : {&newcomers_, &greeted_}) {
    if (row->size() < 2 * protocol::kWorkersMax) continue;
    std::set<protocol::WorkerId> seen;  // who comes back stands there twice
    std::erase_if(*row, [&](protocol::WorkerId id) {
      return entry_of(id) == nullptr || !seen.insert(id).second;
    });
  }
}

void WorkerTable::put_out(protocol::WorkerId id) {
  put_out_.push_back(id);
  forget(workers_.find(id));
}

/// @return  the one behind it
std::map<protocol::WorkerId, WorkerEntry>::iterator WorkerTable::forget(
    std::map<protocol::WorkerId, WorkerEntry>::iterator worker) {
  const auto of_key = num_of_key_.find(protocol::key_part(worker->first));
  if (--of_key->second == 0) num_of_key_.erase(of_key);
  return workers_.erase(worker);
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
    std::erase_if(worker->second.refused,
                  [](const auto& entry) { return !entry.second.by_description; });
    left_.insert_or_assign(worker->first, std::move(worker->second));
    worker = forget(worker);
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

std::set<ContentHash> WorkerTable::forget_refusals(TimePoint now) {
  std::set<ContentHash> to_ask;
  for (auto& [id, worker] : workers_) {
    for (auto& [definition, refusal] : worker.refused) {
      if (now < refusal.until || !refusal.by_description) continue;
      refusal.until = now + kRefusalLasts;
      to_ask.insert(definition);
    }
    std::erase_if(worker.refused, [now](const auto& entry) { return entry.second.until <= now; });
  }
  return to_ask;
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
