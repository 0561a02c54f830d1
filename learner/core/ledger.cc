#include "learner/core/ledger.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"

namespace treeroll::learner {

using protocol::RolloutKey;

void seal(Question& question, RolloutKey key) {
  std::string bytes;
  const auto append = [&bytes](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  append(question.task_id.bytes.data(), question.task_id.bytes.size());
  append(question.policy_id.bytes.data(), question.policy_id.bytes.size());
  append(&question.task_seed, sizeof question.task_seed);
  append(&key.run, sizeof key.run);
  append(&key.number, sizeof key.number);
  append(question.theta.data(), static_cast<std::size_t>(question.theta.size()) * sizeof(double));
  question.content = short_form(content_hash(bytes));
}

std::int64_t content_under(const Question& question, RolloutKey key) {
  Question asked = question;
  seal(asked, key);
  return asked.content;
}

void Ledger::draw(RolloutKey key, Question question) {
  const bool is_first_trial = question.discarded.empty();
  Entry entry;
  entry.question = std::move(question);
  const bool is_new = entries_.emplace(key, std::move(entry)).second;
  CHECK(is_new, "a roll-out was drawn twice");
  ready_.push_back(key);
  if (key.number >= 0 && is_first_trial) ++counters.issued;
}

std::vector<protocol::RolloutRequest> Ledger::lease(TimePoint now,
                                                    const std::vector<Assignment>& chosen) {
  std::vector<protocol::RolloutRequest> requests;
  requests.reserve(chosen.size());
  std::deque<RolloutKey> passed_over;
  std::size_t place = 0;
  for (const Assignment& assignment : chosen) {
    CHECK(place <= assignment.place && assignment.place < ready_.size(), "places must ascend");
    for (; place < assignment.place; ++place) passed_over.push_back(ready_[place]);
    const RolloutKey key = ready_[place++];
    Entry& entry = entries_.at(key);
    CHECK(!entry.lease, "a roll-out was leased twice");
    entry.lease = Lease{assignment.worker, 0, now, assignment.deadline};
    entry.last_worker = assignment.worker;
    index(key, *entry.lease);

    protocol::RolloutRequest request;
    request.worker_id = assignment.worker;
    request.key = key;
    request.attempt = entry.attempt++;
    request.content = entry.question.content;
    request.task_id = entry.question.task_id;
    request.policy_id = entry.question.policy_id;
    request.task_seed = entry.question.task_seed;
    request.theta.assign(entry.question.theta.data(),
                         entry.question.theta.data() + entry.question.theta.size());
    if (request.attempt > 0) ++counters.reissued;
    requests.push_back(std::move(request));
  }
  ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(place));
  ready_.insert(ready_.begin(), passed_over.begin(), passed_over.end());
  return requests;
}

void Ledger::set_batch(RolloutKey key, std::int64_t batch) {
  Entry& entry = entries_.at(key);
  CHECK(entry.lease.has_value(), "only a leased roll-out travels in a batch");
  entry.lease->batch = batch;
}

void Ledger::extend(RolloutKey key, protocol::WorkerId worker, TimePoint deadline) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return;
  std::optional<Lease>& lease = found->second.lease;
  if (!lease || lease->worker != worker) return;
  deadlines_.erase({lease->deadline, key});
  lease->deadline = deadline;
  deadlines_.emplace(deadline, key);
}

void Ledger::take_back(RolloutKey key) {
  Entry& entry = entries_.at(key);
  CHECK(entry.lease.has_value(), "only a leased roll-out can be taken back");
  drop_from_indices(key, *entry.lease);
  entry.lease.reset();
  ready_.push_front(key);
}

void Ledger::take_back_lost(RolloutKey key) {
  take_back(key);
  entries_.at(key).last_worker = 0;
}

void Ledger::take_back_all(protocol::WorkerId worker) {
  const std::set<RolloutKey> leases = leases_of(worker);
  for (const RolloutKey key : leases) take_back(key);
}

std::vector<RolloutKey> Ledger::expire(TimePoint now) {
  std::vector<RolloutKey> expired;
  while (!deadlines_.empty() && deadlines_.begin()->first <= now) {
    expired.push_back(deadlines_.begin()->second);
    take_back(expired.back());
  }
  return expired;
}

std::optional<TimePoint> Ledger::next_deadline() const {
  if (deadlines_.empty()) return std::nullopt;
  return deadlines_.begin()->first;
}

const std::set<RolloutKey>& Ledger::leases_of(protocol::WorkerId worker) const {
  static const std::set<RolloutKey> kNone;
  const auto found = leases_.find(worker);
  return found == leases_.end() ? kNone : found->second;
}

void Ledger::index(RolloutKey key, const Lease& lease) {
  deadlines_.emplace(lease.deadline, key);
  leases_[lease.worker].insert(key);
}

void Ledger::drop_from_indices(RolloutKey key, const Lease& lease) {
  deadlines_.erase({lease.deadline, key});
  const auto of_worker = leases_.find(lease.worker);
  of_worker->second.erase(key);
  if (of_worker->second.empty()) leases_.erase(of_worker);
}

const Ledger::Entry* Ledger::find(RolloutKey key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second;
}

Ledger::Entry Ledger::close(RolloutKey key) {
  const auto found = entries_.find(key);
  CHECK(found != entries_.end(), "only an open roll-out can be closed");
  Entry entry = std::move(found->second);
  if (entry.lease) {
    drop_from_indices(key, *entry.lease);
  } else {
    // Taken back and answered after all, by the worker that had it: no longer ready.
    ready_.erase(std::find(ready_.begin(), ready_.end(), key));
  }
  entries_.erase(found);
  return entry;
}

}  // namespace treeroll::learner
