#include "learner/core/workforce.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/cut_text.h"
#include "common/protocol/timings.h"
#include "learner/core/batching.h"
#include "learner/core/dispatch.h"
#include "learner/core/hedging.h"

namespace treeroll::learner {
namespace {

/// Roll-outs of one task take so many times their mean, now and then.
constexpr double kPatienceInDurations = 4;
/// Between two looks at what idle evaluators could be given too.
constexpr Duration kHedgeInterval = std::chrono::milliseconds(100);
/// So few more workers are not loud.
constexpr int kFewWorkers = 64;

}  // namespace

Workforce::Workforce(LearnerSettings settings, Client& client)
    : settings_(std::move(settings)),
      client_(client),
      workers_(settings_.is_authenticated),
      classes_(settings_.numeric_class) {}

void Workforce::start(const Turn& turn) {
  last_progress_ = turn.now;
  for (const ContentHash& id : task_ids_) definitions_.publish(task_name(id), turn.now);
}

void Workforce::receive(const Turn& turn, const protocol::Message& message) {
  if (const auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
    on(turn, *batch);
  } else if (const auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    on(turn, *status);
  } else if (const auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    on(turn, *request);
  } else if (const auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    on(turn, *report);
  }
}

std::optional<TimePoint> Workforce::next_deadline() const {
  std::optional<TimePoint> next;
  for (const std::optional<TimePoint> one :
       {ledger_.next_deadline(), workers_.next_look(), definitions_.next_burst(), acknowledge_by_,
        describe_at_}) {
    if (one && (!next || *one < *next)) next = one;
  }
  return next;
}

void Workforce::look_after_leases(const Turn& turn) {
  for (const WorkerEntry& silent : workers_.remove_silent(turn.now)) {
    if (silent.joined) {
      turn.warn("workers that leave",
                fmt::format("{} has left: silent for {:.0f} s, {} roll-outs taken back",
                            describe(silent), to_seconds(workers_.heartbeats().silence),
                            ledger_.leases_of(silent.id).size()));
    }
    ledger_.take_back_all(silent.id);
    accounts_.forget(silent.id);
  }
  for (const Ledger::Expired& expired : ledger_.expire(turn.now)) {
    if (expired.lease.confirmed) continue;
    note_lost(turn.now, expired.lease.worker, expired.lease.issued_at);
  }
}

void Workforce::remind(const Turn& turn) {
  for (const ContentHash& task : workers_.forget_refusals(turn.now)) {
    definitions_.publish(task_name(task), turn.now);
  }
  for (const WorkerEntry* worker : workers_.trust_again(turn.now)) {
    turn.inform("workers trusted again", fmt::format("{} is trusted again", describe(*worker)));
  }
  refuses_workers_ = refuses_workers_ && workers_.is_full();
  publish_undescribed_tasks(turn.now);
}

int Workforce::count_workers(TimePoint now) {
  num_joined_since_ = 0;
  num_told_ = workers_.num_joined();
  workers_.note_told(now, num_told_);
  return num_told_;
}

bool Workforce::has_grown() const { return num_joined_since_ > std::max(num_told_, kFewWorkers); }

void Workforce::begin_sync() {
  num_syncing_ = num_unsynced_;
  for (const protocol::WorkerId id : answers_unsynced_) {
    WorkerEntry* worker = workers_.find(id);
    if (worker) worker->last_index_syncing = worker->results_read.last_without_gap();
  }
  answers_syncing_.merge(answers_unsynced_);
  answers_unsynced_.clear();
}

void Workforce::end_sync(TimePoint now) {
  num_unsynced_ -= std::exchange(num_syncing_, 0);
  for (const protocol::WorkerId id : answers_syncing_) {
    if (WorkerEntry* worker = workers_.find(id)) {
      worker->last_index_settled = std::max(worker->last_index_settled, worker->last_index_syncing);
      acknowledge(id, now + protocol::kSyncPeriod);
    }
  }
  answers_syncing_.clear();
}

void Workforce::dispatch(const Turn& turn) {
  if (describe_at_ && turn.now >= *describe_at_) {
    describe_at_.reset();
    publish_undescribed_tasks(turn.now);
  }
  send_definitions(turn);  // a policy before its roll-outs, and a theta after its own
  const DispatchFacts facts{turn.now, rollout_time_s_, &facts_, &task_times_s_};
  std::vector<Ledger::Assignment> chosen;
  if (gives_out_ && !journal_is_behind()) {
    chosen = assign(ledger_, workers_, facts);
  }
  std::vector<protocol::RolloutRequest> requests = ledger_.lease(turn.now, chosen);
  if (gives_out_ && !journal_is_behind() && turn.now >= hedge_at_) {
    hedge_at_ = turn.now + kHedgeInterval;
    for (const Hedge& hedge : hedges(ledger_, workers_, facts)) {
      if (hedge.instead_of != 0) ledger_.take_back(hedge.key, hedge.instead_of);
      requests.push_back(ledger_.lease_too(turn.now, hedge.key, hedge.worker, hedge.deadline));
    }
  }
  for (protocol::RolloutRequest& request : requests) detach_theta(turn.now, request);
  const std::vector<protocol::Acknowledgement> acknowledgements =
      take_acknowledgements(turn.now, !requests.empty());
  for (protocol::RolloutBatch& batch : pack(std::move(requests), acknowledgements,
                                            settings_.batch_bytes_max, settings_.word_bytes)) {
    batch.learner_id = settings_.learner_id;
    batch.sequence = ++last_batch_;
    for (const protocol::RolloutRequest& request : batch.rollouts) {
      ledger_.set_batch(request.key, request.worker_id, batch.sequence);
      WorkerEntry& worker = *workers_.find(request.worker_id);
      worker.requests_sent.note(batch.sequence, request.key);
      worker.asked = true;
    }
    for (const protocol::Acknowledgement& acknowledgement : batch.acknowledgements) {
      workers_.find(acknowledgement.worker_id)->hearing.note_word(turn.now, batch.sequence);
    }
    turn.effects.emplace_back(SendMessage{std::move(batch)});
  }
  send_definitions(turn);
}

/// A word to this worker, no later than then.
void Workforce::acknowledge(protocol::WorkerId id, TimePoint by) {
  acknowledgements_due_.insert(id);
  acknowledge_by_ = std::min(acknowledge_by_.value_or(by), by);
}

/// They wait for roll-outs to go along with, a while. At the end nothing comes to wait for.
std::vector<protocol::Acknowledgement> Workforce::take_acknowledgements(TimePoint now,
                                                                        bool goes_along) {
  std::vector<protocol::Acknowledgement> acknowledgements;
  if (!acknowledge_by_ || (!goes_along && gives_out_ && now < *acknowledge_by_)) {
    return acknowledgements;
  }
  for (const protocol::WorkerId id : acknowledgements_due_) {
    if (const WorkerEntry* worker = workers_.find(id)) {
      acknowledgements.push_back(
          {id, worker->results_read.last_without_gap(), worker->last_index_settled});
    }
  }
  acknowledgements_due_.clear();
  acknowledge_by_.reset();
  return acknowledgements;
}

/// A roll-out that is open no more.
Ledger::Entry Workforce::close(protocol::RolloutKey key, protocol::WorkerId from) {
  if (const auto theta = thetas_.extract(key)) {
    definitions_.release({protocol::DefinitionKind::kTheta, theta.mapped()});
  }
  return ledger_.close(key, from);
}

/// The entry of a worker that has said something; null if there is room for no more workers.
WorkerEntry* Workforce::hear(const Turn& turn, protocol::WorkerId id) {
  WorkerEntry* worker = workers_.hear(id, turn.now);
  for (const protocol::WorkerId out : workers_.take_put_out()) {
    ledger_.take_back_all(out);
    accounts_.forget(out);
  }
  if (worker != nullptr) {
    worker->is_known = settings_.is_authenticated;
    // By an earlier incarnation of ours too. Without keys anybody speaks in anybody's name.
    worker->set_aside = worker->is_known && rechecks_.is_outvoted(id);
  }
  if (worker != nullptr && worker->hearing.greeting_due(turn.now)) {
    acknowledge(id, turn.now);  // it has nothing to acknowledge, perhaps: it is a word to it
  }
  if (worker || refuses_workers_) return worker;
  refuses_workers_ = true;
  turn.warn("workers refused",
            fmt::format("worker {} is refused, and so are others until one leaves: {} workers are "
                        "the most that are served, {} of one key",
                        id, protocol::kWorkersMax, protocol::kWorkersOfOneKeyMax));
  return nullptr;
}

void Workforce::on(const Turn& turn, const protocol::WorkerStatus& status) {
  WorkerEntry* worker = hear(turn, status.worker_id);
  if (!worker) return;
  const bool is_new = worker->num_evaluators == 0;
  const bool starts_draining = status.draining && !worker->draining;
  worker->host = cut_text(status.host, protocol::kHostNameBytesMax);
  worker->pid = status.pid;
  worker->numeric_class = cut_text(status.numeric_class, protocol::kNumericClassBytesMax);
  worker->num_evaluators = status.num_evaluators;
  worker->free_slots = status.free_slots;
  worker->receive_buffer_bytes = status.receive_buffer_bytes;
  worker->draining = status.draining;
  if (is_new) publish_undescribed_tasks(turn.now);
  compare_with_demand(turn, *worker);
  if (starts_draining && worker->joined) {
    turn.inform("workers that drain", fmt::format("{} takes no more roll-outs", describe(*worker)));
  }
  const auto held = std::find_if(
      status.held.begin(), status.held.end(),
      [this](const protocol::HeldRollouts& h) { return h.learner_id == settings_.learner_id; });
  note_echo(turn, *worker, held == status.held.end() ? 0 : held->last_batch);
  if (held == status.held.end()) return;
  settle_suspicion(turn, *worker, *held);
  forget_false_refusals(turn, *worker, *held);
  confirm_leases(turn.now, *worker, held->last_batch, held->keys);
  if (held->last_index <= worker->results_read.last_without_gap()) {
    reconcile(turn.now, *worker, *held);
  }
}

/// What it has heard of us: whether it hears us.
void Workforce::note_echo(const Turn& turn, WorkerEntry& worker, std::int64_t last_batch) {
  const bool hears_now = worker.hearing.note_echo(last_batch);
  // What was sent before we had met neither of us has listened to.
  if (hears_now && facts_.size() < std::set(task_ids_.begin(), task_ids_.end()).size()) {
    describe_at_ =
        std::min(describe_at_.value_or(TimePoint::max()), turn.now + protocol::kPublicationPause);
  }
  if (hears_now && !std::exchange(worker.joined, true)) {
    ++num_joined_since_;
    turn.inform("workers that join", fmt::format("{} has joined with {} evaluators",
                                                 describe(worker), worker.num_evaluators));
  }
  if (worker.hearing.deafness_to_tell(turn.now)) {
    turn.warn("workers that do not answer",
              fmt::format("{} is heard but does not answer: does what we send reach it? "
                          "treeroll-doctor there shows it",
                          describe(worker)));
  }
}

/// A lease that its worker has neither confirmed nor answered.
void Workforce::note_lost(TimePoint now, protocol::WorkerId id, TimePoint issued_at) {
  WorkerEntry* worker = workers_.find(id);
  const bool is_doubted = worker != nullptr && worker->hearing.note_lost(now, issued_at);
  if (is_doubted) ledger_.take_back_unconfirmed(id);
}

Duration Workforce::patience() const {
  double patience_s = 0;
  for (const ContentHash& id : task_ids_) {
    const auto time = task_times_s_.find(id);
    const TaskDescription* facts = facts_of(id);
    // A robot may wait for its operator, who takes other times than the last ones.
    const bool has_operator = facts != nullptr && !facts->repeatable;
    if (time != task_times_s_.end() && !has_operator) {
      patience_s = std::max(patience_s, kPatienceInDurations * time->second);
    } else if (facts != nullptr) {
      patience_s = std::max(patience_s, facts->time_limit_s);
    }
  }
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(patience_s));
}

}  // namespace treeroll::learner
