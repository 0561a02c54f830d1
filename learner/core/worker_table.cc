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
    if (!has_room_for(id, now)) return nullptr;
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
    entry.arrival = ++num_arrivals_;
    entry.alive_for = heartbeats_.alive;
    if (has_keys_) of_key_.try_emplace(protocol::key_part(id), protocol::kWorkersOfOneKeyMax);
    for (Group* group : groups_of(id)) {
      ++group->num_present;
      group->newcomers.emplace(entry.arrival, id);
    }
    found = workers_.emplace(id, std::move(entry)).first;
    const TimePoint silence = now + heartbeats_.silence;
    if (!look_at_ || silence < *look_at_) look_at_ = silence;
  }
  found->second.last_heard = now;
  return &found->second;
}

/// That of its key first: one of those is one of all.
std::vector<WorkerTable::Group*> WorkerTable::groups_of(protocol::WorkerId id) {
  std::vector<Group*> groups;
  const auto of_key = of_key_.find(protocol::key_part(id));
  if (of_key != of_key_.end()) groups.push_back(&of_key->second);
  groups.push_back(&all_);
  return groups;
}

bool WorkerTable::has_room_for(protocol::WorkerId id, TimePoint now) {
  const std::vector<Group*> groups = groups_of(id);
  return std::ranges::all_of(groups, [&](Group* group) { return make_room(*group, now); });
}

/// Thousands of names cost nothing to make up, and where they are signed a recording has those of
/// all workers that have been: they would keep all others out. So one that has not answered a
/// greeting makes room, the first heard first: who is a worker answers at once. Then, now and then,
/// one that has answered nothing else for long: greetings can be heard by all. A worker that is put
/// out comes back with its next word.
bool WorkerTable::make_room(Group& group, TimePoint now) {
  while (group.is_full() && !group.newcomers.empty()) {
    const Arrival oldest = *group.newcomers.begin();
    const WorkerEntry& worker = workers_.at(oldest.second);
    if (!worker.has_answered_a_greeting()) {
      put_out(oldest.second);
      continue;
    }
    group.newcomers.erase(oldest);
    if (worker.num_accepted == 0) group.greeted.insert(oldest);
  }
  while (group.is_full() && !group.greeted.empty() && now >= group.next_put_out) {
    const Arrival oldest = *group.greeted.begin();
    const WorkerEntry& worker = workers_.at(oldest.second);
    if (worker.num_accepted > 0) {
      group.greeted.erase(oldest);
      continue;
    }
    if (now < worker.first_heard + kAnswerDue) break;  // the others are younger
    put_out(oldest.second);
    group.next_put_out = now + kPutOutPause;
  }
  return !group.is_full();
}

void WorkerTable::put_out(protocol::WorkerId id) {
  put_out_.push_back(id);
  forget(workers_.find(id));
}

/// @return  the one behind it
std::map<protocol::WorkerId, WorkerEntry>::iterator WorkerTable::forget(
    std::map<protocol::WorkerId, WorkerEntry>::iterator worker) {
  const Arrival arrival{worker->second.arrival, worker->first};
  for (Group* group : groups_of(worker->first)) {
    --group->num_present;
    group->newcomers.erase(arrival);
    group->greeted.erase(arrival);
  }
  const auto of_key = of_key_.find(protocol::key_part(worker->first));
  if (of_key != of_key_.end() && of_key->second.num_present == 0) of_key_.erase(of_key);
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
