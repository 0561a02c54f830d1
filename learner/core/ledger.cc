#include "learner/core/ledger.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"

namespace treeroll::learner {

using protocol::RolloutKey;

namespace {

/// Precondition: the worker has one.
Ledger::Lease& lease_at(Ledger::Entry& entry, protocol::WorkerId worker) {
  const Ledger::Lease* lease = entry.lease_of(worker);
  CHECK(lease != nullptr, "the worker has no lease of this roll-out");
  return entry.leases[static_cast<std::size_t>(lease - entry.leases.data())];
}

}  // namespace

void seal(Question& question, RolloutKey key) {
  std::string bytes;
  bytes.reserve(2 * sizeof question.task_id.bytes + 2 * sizeof(std::int64_t) +
                static_cast<std::size_t>(question.theta.size()) * sizeof(double));
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

bool Question::was_answered_by(protocol::WorkerId worker) const {
  return std::ranges::find(answered_by, worker, &KnownWorker::worker_id) != answered_by.end();
}

void Ledger::draw(RolloutKey key, Question question, std::vector<protocol::WorkerId> asked) {
  const bool is_new_rollout = question.discarded.empty() && !question.is_run_again();
  Entry entry;
  entry.asked = std::move(asked);
  entry.question = std::move(question);
  const bool is_new = entries_.emplace(key, std::move(entry)).second;
  CHECK(is_new, "a roll-out was drawn twice");
  ready_.push_back(key);
  if (key.number >= 0 && is_new_rollout) ++counters.issued;
}

/// Of a worker that has something, perhaps for the last time.
template <class Change>
void Ledger::change_share(protocol::WorkerId worker, const Change& change) {
  const auto found = shares_.find(worker);
  if (found == shares_.end()) return;
  change(found->second);
  if (found->second.size() == 0) shares_.erase(found);
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
    CHECK(entry.leases.empty(), "a roll-out was leased twice");
    requests.push_back(add_lease(now, key, entry, assignment.worker, assignment.deadline));
  }
  ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(place));
  ready_.insert(ready_.begin(), passed_over.begin(), passed_over.end());
  return requests;
}

protocol::RolloutRequest Ledger::lease_too(TimePoint now, RolloutKey key, protocol::WorkerId worker,
                                           TimePoint deadline) {
  Entry& entry = entries_.at(key);
  CHECK(!entry.leases.empty() && entry.leases.size() < kLeasesMax && !entry.lease_of(worker),
        "a second lease is for a second worker");
  return add_lease(now, key, entry, worker, deadline);
}

protocol::RolloutRequest Ledger::add_lease(TimePoint now, RolloutKey key, Entry& entry,
                                           protocol::WorkerId worker, TimePoint deadline) {
  entry.leases.push_back(
      {.worker = worker, .batch = 0, .issued_at = now, .deadline = deadline, .confirmed = false});
  entry.last_worker = worker;
  if (!entry.was_asked(worker)) {
    if (entry.asked.size() >= protocol::kAskedMax) entry.asked.erase(entry.asked.begin());
    entry.asked.push_back(worker);
  }
  deadlines_.emplace(deadline, key, worker);
  shares_[worker].leases.insert(key);

  protocol::RolloutRequest request;
  request.worker_id = worker;
  request.key = key;
  request.attempt = entry.attempt++;
  request.content = entry.question.content;
  request.task_id = entry.question.task_id;
  request.policy_id = entry.question.policy_id;
  request.task_seed = entry.question.task_seed;
  request.theta.assign(entry.question.theta.data(),
                       entry.question.theta.data() + entry.question.theta.size());
  if (request.attempt > 0) ++counters.reissued;
  return request;
}

const Ledger::Lease* Ledger::Entry::lease_of(protocol::WorkerId worker) const {
  const auto found = std::find_if(leases.begin(), leases.end(),
                                  [worker](const Lease& lease) { return lease.worker == worker; });
  return found == leases.end() ? nullptr : &*found;
}

bool Ledger::Entry::was_asked(protocol::WorkerId worker) const {
  return std::find(asked.begin(), asked.end(), worker) != asked.end();
}

void Ledger::set_batch(RolloutKey key, protocol::WorkerId worker, std::int64_t batch) {
  lease_at(entries_.at(key), worker).batch = batch;
}

bool Ledger::confirm(RolloutKey key, protocol::WorkerId worker, TimePoint deadline) {
  Lease& lease = lease_at(entries_.at(key), worker);
  auto place = deadlines_.extract({lease.deadline, key, worker});
  std::get<TimePoint>(place.value()) = lease.deadline = deadline;
  deadlines_.insert(std::move(place));
  return !std::exchange(lease.confirmed, true);
}

void Ledger::take_back(RolloutKey key, protocol::WorkerId worker) {
  Entry& entry = entries_.at(key);
  const Lease& lease = lease_at(entry, worker);
  drop_from_indices(key, lease);
  entry.leases.erase(entry.leases.begin() + (&lease - entry.leases.data()));
  if (entry.leases.empty()) {
    ready_.push_front(key);
  } else {
    entry.last_worker = entry.leases.front().worker;
  }
}

void Ledger::take_back_lost(RolloutKey key, protocol::WorkerId worker) {
  take_back(key, worker);
  Entry& entry = entries_.at(key);
  if (entry.last_worker == worker) entry.last_worker = 0;
}

void Ledger::take_back_all(protocol::WorkerId worker) {
  const std::set<RolloutKey> leases = leases_of(worker);
  for (const RolloutKey key : leases) take_back(key, worker);
  change_share(worker, [](Share& share) { share.copies.clear(); });
}

void Ledger::take_back_unconfirmed(protocol::WorkerId worker) {
  const std::set<RolloutKey> leases = leases_of(worker);
  for (const RolloutKey key : leases) {
    if (!find(key)->lease_of(worker)->confirmed) take_back(key, worker);
  }
}

std::vector<Ledger::Expired> Ledger::expire(TimePoint now) {
  std::vector<Expired> expired;
  while (!deadlines_.empty() && std::get<TimePoint>(*deadlines_.begin()) <= now) {
    const auto [deadline, key, worker] = *deadlines_.begin();
    expired.push_back({key, *find(key)->lease_of(worker)});
    take_back(key, worker);
  }
  return expired;
}

std::optional<TimePoint> Ledger::next_deadline() const {
  if (deadlines_.empty()) return std::nullopt;
  return std::get<TimePoint>(*deadlines_.begin());
}

const Ledger::Share& Ledger::share_of(protocol::WorkerId worker) const {
  static const Share kNone;
  const auto found = shares_.find(worker);
  return found == shares_.end() ? kNone : found->second;
}

void Ledger::drop_from_indices(RolloutKey key, const Lease& lease) {
  deadlines_.erase({lease.deadline, key, lease.worker});
  change_share(lease.worker, [key](Share& share) { share.leases.erase(key); });
}

const Ledger::Entry* Ledger::find(RolloutKey key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second;
}

Ledger::Entry Ledger::close(RolloutKey key, protocol::WorkerId from) {
  const auto found = entries_.find(key);
  CHECK(found != entries_.end(), "only an open roll-out can be closed");
  Entry entry = std::move(found->second);
  // Taken back and answered after all, by the worker that had it: no longer ready.
  if (entry.leases.empty()) ready_.erase(std::find(ready_.begin(), ready_.end(), key));
  for (const Lease& lease : entry.leases) {
    drop_from_indices(key, lease);
    if (lease.worker != from) shares_[lease.worker].copies.emplace(key, lease.batch);
  }
  entries_.erase(found);
  return entry;
}

void Ledger::forget_copy(RolloutKey key, protocol::WorkerId worker) {
  change_share(worker, [key](Share& share) { share.copies.erase(key); });
}

}  // namespace treeroll::learner
