// What workers answer: accepted or not, and what it says of the leases.
#include <fmt/format.h>

#include <algorithm>

#include "common/protocol/timings.h"
#include "learner/core/dispatch.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {
namespace {

constexpr double kTimingWeight = .1;

}  // namespace

void Workforce::on(const Turn& turn, const protocol::RewardBatch& batch) {
  if (batch.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = hear(turn, batch.worker_id);
  if (!worker) return;
  std::size_t num_read = 0;
  // What is not read while the disk lags is not acknowledged, so its worker repeats it.
  for (; num_read < batch.results.size() && !journal_is_behind(); ++num_read) {
    const protocol::RolloutResult& result = batch.results[num_read];
    const std::int64_t index = batch.first_index + static_cast<std::int64_t>(num_read);
    // A repetition is looked at only if it answers what is still open: no index, however wrong,
    // can keep an answer out.
    if (worker->results_read.contains(index) && !answers_open_question(result, worker->id)) {
      if (worker->asked) compare_repeated(turn, *worker, result);
      continue;
    }
    ledger_.forget_copy(result.key, worker->id);
    worker->late = false;
    if (!accept(turn, *worker, result, index)) break;
  }
  worker->results_read.forget_before(batch.oldest_index);
  if (num_read > 0) {
    worker->results_read.note(batch.first_index,
                              batch.first_index + static_cast<std::int64_t>(num_read) - 1);
  }
  if (num_unsynced_ == 0) {
    worker->last_index_settled = worker->results_read.last_without_gap();
  } else {
    answers_unsynced_.insert(worker->id);
  }
  acknowledge(worker->id, turn.now + protocol::kSeenDelayMax);
  worker->free_slots = batch.free_slots;
  note_requests(turn.now, *worker, batch);
}

/// Nobody who was asked, so nobody who can know.
bool Workforce::note_unasked(const Turn& turn, const WorkerEntry& worker) {
  ++ledger_.counters.unasked;
  turn.warn("strangers",
            fmt::format("{} answers what it was not asked: refused, {} so far; keys keep strangers "
                        "out (--key-file)",
                        describe(worker), ledger_.counters.unasked));
  return true;
}

/// Whether it has been read: it need not come again then.
bool Workforce::accept(const Turn& turn, WorkerEntry& worker, const protocol::RolloutResult& result,
                       std::int64_t index) {
  const protocol::RolloutKey key = result.key;
  const std::optional<ContentHash> task_id = client_.task_of(key);
  const TaskDescription* facts = task_id ? facts_of(*task_id) : nullptr;
  // Of its class nothing is known before its heartbeat.
  const bool has_no_say =
      worker.distrusted || worker.set_aside || !classes_.allows(worker.numeric_class);
  if (!facts || has_no_say) {  // without facts nothing of this run has been issued
    ++ledger_.counters.rejected;
    return true;
  }
  const Ledger::Entry* open = ledger_.find(key);
  if (!open && !worker.asked) return note_unasked(turn, worker);
  if (!open) return compare_with_taken(turn, worker, result, *facts);
  if (open->question.content != result.content) {
    const std::vector<std::int64_t>& discarded = open->question.discarded;
    const bool is_repeated = std::ranges::find(discarded, result.content) != discarded.end();
    // Else an answer to an older question.
    ++(is_repeated ? ledger_.counters.duplicate : ledger_.counters.rejected);
    return true;
  }
  // It is run again: a word of those who have answered it is a repetition.
  if (open->question.was_answered_by(worker.id)) {
    return compare_with_taken(turn, worker, result, *facts);
  }
  if (!open->was_asked(worker.id)) return note_unasked(turn, worker);
  if (accounts_.has(*task_id) && !worker.described.contains(*task_id)) {
    ask_for_description(turn, worker, *task_id);
    return false;  // read once it has said
  }
  if (worker.describes_otherwise(*task_id)) {
    ++ledger_.counters.rejected;
    if (open->lease_of(worker.id)) ledger_.take_back(key, worker.id);
    return true;
  }
  const Outcome& outcome = result.outcome;
  if (outcome.is_ok() && !facts->is_in_range(outcome.reward()))
    return suspect(turn, worker, result, index, *facts);

  note_timing(turn.now, worker, result, *open);
  Ledger::Entry entry = close(key, worker.id);
  const bool is_second = entry.question.is_run_again();
  if (!is_second && !entry.lease_of(worker.id)) ++ledger_.counters.late;
  worker.hearing.note_confirmed();
  if (outcome.is_ok()) clear_of_suspicion(turn, worker, entry, key);
  ++worker.num_accepted;
  last_progress_ = turn.now;
  note_class(turn, worker);
  note_signals(turn, *task_id);
  const AcceptedResult accepted{key, result.content, outcome, worker.id, result.duration_ns};
  ++num_unsynced_;
  if (is_second) {
    turn.effects.emplace_back(AppendSecond{{accepted}});
    tell(turn, take_second(std::move(entry), accepted), key);
    return true;
  }
  count_class(turn, worker);
  turn.effects.emplace_back(AppendResult{accepted});
  hand_over(turn, std::move(entry), accepted, classes_.index(worker.numeric_class));
  return true;
}

/// An answer to a roll-out that is not open: a duplicate, or to nothing that was asked.
bool Workforce::compare_with_taken(const Turn& turn, const WorkerEntry& worker,
                                   const protocol::RolloutResult& result,
                                   const TaskDescription& facts) {
  const std::optional<Answer> before = client_.answer_of(result.key);
  if (!before) {
    ++ledger_.counters.rejected;
    return true;
  }
  ++ledger_.counters.duplicate;
  note_conflict(turn, worker, result, *before, facts);
  return true;
}

/// Under this index something has been taken in the worker's name. If that was a stranger's, the
/// worker's own answer comes under the same, and only here.
void Workforce::compare_repeated(const Turn& turn, const WorkerEntry& worker,
                                 const protocol::RolloutResult& result) {
  const std::optional<ContentHash> task_id = client_.task_of(result.key);
  const TaskDescription* facts = task_id ? facts_of(*task_id) : nullptr;
  const std::optional<Answer> before = facts ? client_.answer_of(result.key) : std::nullopt;
  if (before) note_conflict(turn, worker, result, *before, *facts);
}

/// Says so if these are two answers of which one must be wrong.
void Workforce::note_conflict(const Turn& turn, const WorkerEntry& worker,
                              const protocol::RolloutResult& result, const Answer& before,
                              const TaskDescription& facts) {
  const bool comparable = facts.deterministic && !result.outcome.is_discarded() &&
                          !before.outcome.is_discarded() && before.numeric_class != kUnknownClass &&
                          before.numeric_class == classes_.index(worker.numeric_class);
  if (!comparable || before.outcome.agrees_with(result.outcome)) return;
  ++ledger_.counters.conflicting;
  turn.warn("suspicious results",
            fmt::format("{} gave reward {} where {} was accepted, run {} roll-out {}: one of two "
                        "workers of the same numeric class is broken, or somebody answers in "
                        "another one's name (--key-file)",
                        describe(worker), result.outcome.reward(), before.outcome.reward(),
                        result.key.run, result.key.number));
}

void Workforce::note_timing(TimePoint now, WorkerEntry& worker,
                            const protocol::RolloutResult& result, const Ledger::Entry& entry) {
  const double duration_s = static_cast<double>(result.duration_ns) * 1e-9;
  const auto follow = [duration_s](double& mean_s) {
    mean_s = mean_s == 0 ? duration_s : mean_s + kTimingWeight * (duration_s - mean_s);
  };
  follow(rollout_time_s_);
  follow(task_times_s_[entry.question.task_id]);
  const Ledger::Lease* lease = entry.lease_of(worker.id);
  if (!lease) return;
  const double answer_s = to_seconds(now - lease->issued_at);
  double& median_s = worker.answer_time_s ? *worker.answer_time_s
                                          : worker.answer_time_s.emplace(std::max(answer_s, 1e-6));
  // The median, in small steps: answers that were lost at first come late and would stretch a mean.
  median_s *= answer_s > median_s ? 1 + kTimingWeight : 1 / (1 + kTimingWeight);
}

bool Workforce::answers_open_question(const protocol::RolloutResult& result,
                                      protocol::WorkerId worker) const {
  const Ledger::Entry* open = ledger_.find(result.key);
  return open && open->question.content == result.content &&
         !open->question.was_answered_by(worker);
}

TimePoint Workforce::lease_end_if_held(TimePoint now, const WorkerEntry& worker) const {
  const std::size_t num_leased = ledger_.leases_of(worker.id).size();
  const Duration lease = lease_duration(worker, num_leased, rollout_time_s_);
  return now + std::max(workers_.heartbeats().held_lease_min, lease);
}

/// What it says it holds. Of a lease it cannot have read yet, an old word says nothing.
void Workforce::confirm_leases(TimePoint now, WorkerEntry& worker, std::int64_t last_batch,
                               const std::vector<protocol::RolloutKey>& held) {
  const TimePoint extended = lease_end_if_held(now, worker);
  for (const protocol::RolloutKey key : held) {
    const Ledger::Entry* entry = ledger_.find(key);
    const Ledger::Lease* of_worker = entry ? entry->lease_of(worker.id) : nullptr;
    if (!of_worker || of_worker->batch > last_batch) continue;
    confirm(worker, key, extended);
  }
}

void Workforce::confirm(WorkerEntry& worker, protocol::RolloutKey key, TimePoint extended) {
  if (ledger_.confirm(key, worker.id, extended)) worker.hearing.note_confirmed();
}

/// Takes back the lease of a request that was lost on the way to this worker.
/// @param has_neither  it has said that it has no answer to it either; else it may have one from an
///                     earlier batch, and is asked again while nothing speaks against it
void Workforce::take_back_lost(TimePoint now, WorkerEntry& worker, protocol::RolloutKey key,
                               bool has_neither) {
  const Ledger::Lease lost = *ledger_.find(key)->lease_of(worker.id);
  has_neither ? ledger_.take_back_lost(key, worker.id) : ledger_.take_back(key, worker.id);
  if (!lost.confirmed) note_lost(now, worker.id, lost.issued_at);
}

/// Which requests have come, and which were lost on the way.
void Workforce::note_requests(TimePoint now, WorkerEntry& worker,
                              const protocol::RewardBatch& batch) {
  const RequestsSent::Report report =
      worker.requests_sent.take(batch.last_batch, batch.batches_received);
  const auto is_out = [&](const RequestsSent::Request& request) {  // else answered or asked again
    const Ledger::Entry* entry = ledger_.find(request.key);
    const Ledger::Lease* lease = entry ? entry->lease_of(worker.id) : nullptr;
    return lease && lease->batch == request.batch;
  };
  const TimePoint extended = lease_end_if_held(now, worker);
  for (const RequestsSent::Request& request : report.arrived) {
    if (is_out(request)) confirm(worker, request.key, extended);
  }
  for (const RequestsSent::Request& request : report.lost) {
    if (is_out(request)) take_back_lost(now, worker, request.key, false);
  }
}

/// Leases of requests that were lost on the way: the worker has seen a later message, all its
/// answers are in, and it holds neither the roll-out nor an answer to it.
void Workforce::reconcile(TimePoint now, WorkerEntry& worker, const protocol::HeldRollouts& held) {
  confirm_leases(now, worker, held.last_batch, held.keys);
  const std::set<protocol::RolloutKey> holds(held.keys.begin(), held.keys.end());
  // Of keys outside of the slice another message speaks.
  const auto is_without = [&](protocol::RolloutKey key, std::int64_t batch) {
    return held.first <= key && key <= held.last && !holds.contains(key) &&
           batch <= held.last_batch;
  };
  const std::set<protocol::RolloutKey> leases = ledger_.leases_of(worker.id);
  for (const protocol::RolloutKey key : leases) {
    const Ledger::Lease* found = ledger_.find(key)->lease_of(worker.id);
    if (found && is_without(key, found->batch)) take_back_lost(now, worker, key, true);
  }
  const std::map<protocol::RolloutKey, std::int64_t> copies = ledger_.copies_at(worker.id);
  for (const auto& [key, batch] : copies) {
    if (is_without(key, batch)) ledger_.forget_copy(key, worker.id);
  }
}

/// What a result was computed on: for the journal, and for those who watch.
void Workforce::note_class(const Turn& turn, WorkerEntry& worker) {
  if (worker.numeric_class.empty()) return;  // not heard of yet
  if (worker.noted_class != worker.numeric_class) {
    worker.noted_class = worker.numeric_class;
    KnownWorker& noted = noted_[worker.id];
    noted = worker.as_known();
    turn.effects.emplace_back(AppendWorker{noted});
  }
}

/// Something is learnt from this one: who watches the study's bits hears of a new class.
void Workforce::count_class(const Turn& turn, const WorkerEntry& worker) {
  if (!classes_.count(worker.numeric_class)) return;
  if (classes_.counts().size() > 1) {
    turn.warn("numeric classes",
              fmt::format("{} is of another numeric class, {}, than workers before it: the study's "
                          "bits depend on who evaluates what (study.numeric_class demands one)",
                          describe(worker), worker.numeric_class));
  }
  for (auto& [id, other] : workers_.all()) compare_with_demand(turn, other);
}

/// A worker of another class than the study demands gets nothing.
void Workforce::compare_with_demand(const Turn& turn, WorkerEntry& worker) {
  const bool is_other = worker.num_evaluators > 0 && !classes_.allows(worker.numeric_class);
  if (is_other == worker.other_class) return;
  worker.other_class = is_other;
  if (!is_other) return;
  turn.warn(
      "workers of another class",
      fmt::format("{} gets no roll-outs: it is of numeric class {}, the study demands {}",
                  describe(worker), worker.numeric_class.empty() ? "unknown" : worker.numeric_class,
                  classes_.demanded().value_or(kOneClass)));
  ledger_.take_back_all(worker.id);
}

/// As the journal knows it, whatever it has said of itself since: a fold must come to the same.
KnownWorker Workforce::noted_worker(protocol::WorkerId id) const {
  const auto noted = noted_.find(id);
  return noted == noted_.end() ? KnownWorker{id, "", "", 0} : noted->second;
}

void Workforce::recover(const KnownWorker& worker) { noted_[worker.worker_id] = worker; }

void Workforce::recover(const Turn& turn, const AcceptedResult& result) {
  int numeric_class = kUnknownClass;
  if (const auto noted = noted_.find(result.worker_id); noted != noted_.end()) {
    classes_.count(noted->second.numeric_class);
    numeric_class = classes_.index(noted->second.numeric_class);
  }
  hand_over(turn, close(result.key), result, numeric_class);
}

void Workforce::recover(const SecondAnswer& answer) {
  take_second(close(answer.result.key), answer.result);
}

}  // namespace treeroll::learner
