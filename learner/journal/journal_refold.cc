#include "learner/journal/journal_refold.h"

namespace treeroll {
namespace {

/// Under the number that its run had when the record was written.
protocol::RolloutKey key_then(const NumberedRecord& numbered, protocol::RolloutKey key) {
  return {numbered.run_then.value_or(key.run), key.number};
}

JournalRecord as_written(const NumberedRecord& numbered) {
  JournalRecord record = numbered.record;
  if (auto* result = std::get_if<AcceptedResult>(&record)) {
    result->key = key_then(numbered, result->key);
  } else if (auto* second = std::get_if<SecondAnswer>(&record)) {
    second->result.key = key_then(numbered, second->result.key);
  }
  return record;
}

}  // namespace

void Refold::read_ahead(const NumberedRecord& numbered) {
  if (const auto* worker = std::get_if<KnownWorker>(&numbered.record)) {
    workers_.emplace(worker->worker_id, *worker);
  } else if (const auto* second = std::get_if<SecondAnswer>(&numbered.record)) {
    const AcceptedResult& result = second->result;
    const bool is_of_use = !left_out_.contains(result.worker_id) && !result.outcome.is_discarded();
    const auto first = rechecks_.first_of(numbered);
    if (is_of_use && first && left_out_.contains(first->worker)) {
      const protocol::RolloutKey key{first->run_then.value_or(result.key.run), result.key.number};
      AcceptedResult& taking = second_.emplace(Question(key, first->content), result).first->second;
      taking.content = first->content;  // it is to stand where the first one does
    }
  }
  rechecks_.add(numbered);
}

std::vector<JournalRecord> Refold::next(const NumberedRecord& numbered, TimePoint now) {
  std::vector<JournalRecord> records;
  if (std::holds_alternative<JournalSeal>(numbered.record)) return records;
  if (const auto* worker = std::get_if<KnownWorker>(&numbered.record)) {
    if (left_out_.contains(worker->worker_id)) return records;
    workers_[worker->worker_id] = *worker;
    add_worker(worker->worker_id, now, records);
    return records;
  }
  // Who named them may be left out. The workers of who goes on name them again.
  if (std::holds_alternative<TaskSignals>(numbered.record)) return records;
  const auto* result = std::get_if<AcceptedResult>(&numbered.record);
  if (!result) {
    // Time that was spent on what is lost does not count: it is to be learnt again.
    const bool has_lost_some = counts_.num_left_out > counts_.num_replaced;
    if (has_lost_some && std::holds_alternative<LearningTime>(numbered.record)) return records;
    const auto* second = std::get_if<SecondAnswer>(&numbered.record);
    const bool is_kept =
        !second || (!left_out_.contains(second->result.worker_id) && takes(numbered));
    if (is_kept) add(numbered, now, records);
    return records;
  }
  if (numbered.may_be_superseded(result->key) && !takes(numbered)) return records;
  if (!left_out_.contains(result->worker_id)) {
    const bool is_kept = takes(numbered);
    ++(is_kept ? counts_.num_kept : counts_.num_following);
    is_kept ? add(numbered, now, records) : void(changed_runs_.insert(result->key.run));
    return records;
  }
  ++counts_.num_left_out;
  const auto taken = second_.extract(Question(key_then(numbered, result->key), result->content));
  const bool is_same = taken && taken.mapped().outcome.agrees_with(result->outcome);
  if (!is_same) changed_runs_.insert(result->key.run);
  if (!taken) return records;
  const AcceptedResult& other = taken.mapped();
  NumberedRecord in_its_place = numbered;
  in_its_place.record = other;
  if (!takes(in_its_place)) {
    changed_runs_.insert(result->key.run);
    return records;
  }
  ++counts_.num_replaced;
  add_worker(other.worker_id, now, records);
  add(in_its_place, now, records);
  return records;
}

/// Whether it answers what is asked now.
bool Refold::takes(const NumberedRecord& numbered) const {
  if (const auto* result = std::get_if<AcceptedResult>(&numbered.record)) {
    return core_.asks(learner::ResultRecovered{*result, numbered.run_then});
  }
  const auto* second = std::get_if<SecondAnswer>(&numbered.record);
  return !second || core_.asks(learner::SecondRecovered{*second, numbered.run_then});
}

void Refold::add(const NumberedRecord& numbered, TimePoint now,
                 std::vector<JournalRecord>& records) {
  apply(numbered, now, core_);
  records.push_back(as_written(numbered));
}

/// Before its first result; once, as long as it says the same of itself.
void Refold::add_worker(protocol::WorkerId id, TimePoint now, std::vector<JournalRecord>& records) {
  const auto known = workers_.find(id);
  if (known == workers_.end()) return;
  const auto written = written_.find(id);
  if (written != written_.end() && written->second == known->second) return;
  written_[id] = known->second;
  add({.record = known->second}, now, records);
}

}  // namespace treeroll
