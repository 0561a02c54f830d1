#include "learner/core/learner_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "common/base/check.h"
#include "common/base/cut_text.h"
#include "learner/core/batching.h"
#include "learner/core/dispatch.h"

namespace treeroll {
namespace {

constexpr Duration kStatusPeriod = std::chrono::seconds(1);
/// A worker that has refused a definition is asked again after this: the reason may have passed.
constexpr Duration kRefusalLasts = std::chrono::seconds(60);
/// How long roll-outs under way are waited for when the learner is asked to stop.
constexpr Duration kStopGrace = std::chrono::seconds(5);

}  // namespace

LearnerCore::LearnerCore(Study study, LearnerSettings settings)
    : study_(std::move(study)), settings_(std::move(settings)) {
  for (const Condition& condition : study_.conditions) {
    task_ids_.push_back(tasks_.add(condition.task_content));
    const auto known = settings_.known_tasks.find(condition.task_content);
    if (known != settings_.known_tasks.end()) facts_[task_ids_.back()] = known->second;
  }
  policy_ids_.resize(study_.num_runs());
  runs_.reserve(study_.num_runs());
  for (int run = 0; run < study_.num_runs(); ++run) {
    runs_.emplace_back(study_, run);
    num_rollouts_ += study_.conditions[run / study_.repetitions].exploration.num_rollouts;
  }
}

void LearnerCore::step(TimePoint now, const LearnerEvent& event, LearnerEffects& effects) {
  const bool last_words = std::holds_alternative<learner_event::Synced>(event);
  if (outcome_ != Outcome::kRunning && !last_words) return;
  std::visit(
      [&](const auto& what) {
        using What = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<What, learner_event::Started>) {
          on_started(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::InboxDrained>) {
          dispatch(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::Timer>) {
          on_timer(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::Synced>) {
          on_synced(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::Recovered>) {
          recover(*what.result, now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::TimeRecovered>) {
          recover(what.time, now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::StopRequested>) {
          on_stop(now, effects);
        } else {
          std::visit(
              [&](const auto& message) {
                if constexpr (requires { on_message(message, now, effects); }) {
                  on_message(message, now, effects);
                }  // the others are this learner's own or another learner's
              },
              *what.message);
        }
      },
      event);
  if (outcome_ != Outcome::kRunning) log_limiter_.tell_rest(now, effects.log);
}

void LearnerCore::on_started(TimePoint now, LearnerEffects& effects) {
  started_at_ = last_progress_ = now;
  next_status_ = now;
  for (const ContentHash& task_id : task_ids_) publish_task(task_id, now, effects);
  for (Run& run : runs_) draw(run, now, effects);
}

TimePoint LearnerCore::next_deadline() const {
  TimePoint next = next_status_;
  if (const auto lease = ledger_.next_deadline()) next = std::min(next, *lease);
  if (const auto look = workers_.next_look()) next = std::min(next, *look);
  if (stop_at_) next = std::min(next, *stop_at_);
  if (const auto end = time_end()) next = std::min(next, *end);
  return next;
}

void LearnerCore::on_timer(TimePoint now, LearnerEffects& effects) {
  if (!at_work_since_) {
    at_work_since_ = now;
    learnt_before_ = learnt_.elapsed;
  }
  if (const auto end = time_end(); end && (now >= *end || now >= next_status_)) {
    read_clock(now, effects);
  }
  for (const WorkerEntry& silent : workers_.remove_silent(now)) {
    log(now,
        {LogLine::Level::kWarning, "workers that leave",
         fmt::format("{} has left: silent for {:.0f} s, {} roll-outs taken back", describe(silent),
                     to_seconds(WorkerTable::kSilence), silent.leases.size())},
        effects);
    for (const protocol::RolloutKey key : silent.leases) ledger_.take_back(key);
  }
  for (const auto& [key, worker] : ledger_.expire(now)) {
    if (WorkerEntry* entry = workers_.find(worker)) entry->leases.erase(key);
  }
  if (now >= next_status_) {
    workers_.forget_refusals(now);
    refuses_workers_ = refuses_workers_ && workers_.is_full();
    for (const ContentHash& task_id : task_ids_) {
      if (!facts_.contains(task_id)) publish_task(task_id, now, effects);
    }
    publish_status(now, effects);
    log_limiter_.tell_due(now, effects.log);
    next_status_ = now + kStatusPeriod;
  }
  finish_if_stopped(now, effects);
  dispatch(now, effects);
}

/// The entry of a worker that has said something; null if there is room for no more workers.
WorkerEntry* LearnerCore::hear(protocol::WorkerId id, TimePoint now, LearnerEffects& effects) {
  WorkerEntry* worker = workers_.hear(id, now);
  if (worker || refuses_workers_) return worker;
  refuses_workers_ = true;
  log(now,
      {LogLine::Level::kWarning, "workers refused",
       fmt::format("worker {:x} is refused, and so are others until one leaves: {} workers are the "
                   "most that are served",
                   id, protocol::kWorkersMax)},
      effects);
  return nullptr;
}

void LearnerCore::on_message(const protocol::RewardBatch& batch, TimePoint now,
                             LearnerEffects& effects) {
  if (batch.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = hear(batch.worker_id, now, effects);
  if (!worker) return;
  std::size_t num_read = 0;
  // What is not read while the disk lags is not acknowledged, so its worker repeats it.
  for (; num_read < batch.results.size() && !journal_is_behind(); ++num_read) {
    const protocol::RolloutResult& result = batch.results[num_read];
    const std::int64_t index = batch.first_index + static_cast<std::int64_t>(num_read);
    // A repetition is looked at only if it answers what is still open: no index, however wrong,
    // can keep an answer out.
    if (index <= worker->settled && !answers_open_question(result)) continue;
    accept(*worker, result, now, effects);
    worker->settled = std::max(worker->settled, index);
  }
  if (num_read > 0) {
    worker->answered = batch.first_index + static_cast<std::int64_t>(num_read) - 1;
    // It repeats what it need not: our word was lost, or an older batch came between.
    if (num_unsynced_ == 0) worker->acknowledged = worker->answered;
    (worker->answered == worker->acknowledged ? acknowledgements_due_ : answers_unsynced_)
        .insert(worker->id);
  }
  worker->free_slots = batch.free_slots;
  if (batch.last_index <= worker->answered) reconcile(*worker, batch.last_batch, batch.held, now);
  finish_if_stopped(now, effects);
}

/// Only what will survive us may be forgotten by those who have it.
void LearnerCore::on_synced(TimePoint now, LearnerEffects& effects) {
  num_unsynced_ = 0;
  for (const protocol::WorkerId id : answers_unsynced_) {
    if (WorkerEntry* worker = workers_.find(id)) worker->acknowledged = worker->answered;
  }
  acknowledgements_due_.merge(answers_unsynced_);
  answers_unsynced_.clear();
  dispatch(now, effects);
}

void LearnerCore::on_stop(TimePoint now, LearnerEffects& effects) {
  stop_at_ = now + kStopGrace;
  finish_if_stopped(now, effects);
}

void LearnerCore::finish_if_stopped(TimePoint now, LearnerEffects& effects) {
  if (!stop_at_ || outcome_ != Outcome::kRunning) return;
  if (ledger_.num_leased() > 0 && now < *stop_at_) return;
  read_clock(now, effects);
  publish_status(now, effects);
  outcome_ = Outcome::kStopped;
}

void LearnerCore::on_message(const protocol::WorkerStatus& status, TimePoint now,
                             LearnerEffects& effects) {
  WorkerEntry* worker = hear(status.worker_id, now, effects);
  if (!worker) return;
  const bool is_new = worker->num_evaluators == 0;
  const bool starts_draining = status.draining && !worker->draining;
  worker->host = status.host;
  worker->pid = status.pid;
  worker->numeric_class = status.numeric_class;
  worker->num_evaluators = status.num_evaluators;
  worker->free_slots = status.free_slots;
  worker->receive_buffer_bytes = status.receive_buffer_bytes;
  worker->draining = status.draining;
  if (is_new) {
    log(now,
        {LogLine::Level::kInfo, "workers that join",
         fmt::format("{} has joined with {} evaluators", describe(*worker),
                     worker->num_evaluators)},
        effects);
    for (const ContentHash& task_id : task_ids_) {
      if (!facts_.contains(task_id)) publish_task(task_id, now, effects);
    }
  }
  if (starts_draining) {
    log(now,
        {LogLine::Level::kInfo, "workers that drain",
         fmt::format("{} takes no more roll-outs", describe(*worker))},
        effects);
  }
  const auto held = std::find_if(
      status.held.begin(), status.held.end(),
      [this](const protocol::HeldRollouts& h) { return h.learner_id == settings_.learner_id; });
  if (held != status.held.end()) {
    extend_leases(*worker, held->keys, now);
    if (held->last_index <= worker->answered) {
      reconcile(*worker, held->last_batch, held->keys, now);
    }
  }
}

void LearnerCore::on_message(const protocol::DefinitionRequest& request, TimePoint now,
                             LearnerEffects& effects) {
  if (request.learner_id != settings_.learner_id) return;
  if (!hear(request.worker_id, now, effects)) return;
  for (const ContentHash& id : request.task_ids) publish_task(id, now, effects);
  for (const ContentHash& id : request.policy_ids) publish_policy(id, now, effects);
}

void LearnerCore::on_message(const protocol::DefinitionReport& report, TimePoint now,
                             LearnerEffects& effects) {
  if (report.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = hear(report.worker_id, now, effects);
  if (!worker) return;
  const bool is_task = tasks_.find(report.definition_id) != nullptr;
  if (!is_task && !policies_.find(report.definition_id)) return;
  if (report.accepted) {
    worker->refused.erase(report.definition_id);
    if (!is_task || facts_.contains(report.definition_id)) return;
    Result<TaskDescription> facts = task_description_from_json(report.text);
    if (facts) return learn_facts(report.definition_id, *facts);
    // Its own description makes no sense: another worker's may.
    refuse(*worker, report.definition_id, facts.error().message, now, effects);
    return;
  }
  refuse(*worker, report.definition_id, report.text, now, effects);
}

void LearnerCore::refuse(WorkerEntry& worker, const ContentHash& definition,
                         const std::string& reason, TimePoint now, LearnerEffects& effects) {
  const bool is_new = !worker.refused.contains(definition);
  if (is_new && worker.refuses_too_much()) return;
  worker.refused[definition] = {cut_text(reason, protocol::kReasonBytesMax), now + kRefusalLasts};
  if (!is_new) return;
  log(now,
      {LogLine::Level::kWarning, "definitions refused",
       fmt::format("{} refuses the {}: {}", describe(worker),
                   tasks_.find(definition) ? "task" : "policy", worker.refused[definition].reason)},
      effects);
  const std::set<protocol::RolloutKey> leases = worker.leases;
  for (const protocol::RolloutKey key : leases) {
    const Question& question = ledger_.find(key)->question;
    if (question.task_id == definition || question.policy_id == definition) {
      take_back(worker, key);
    }
  }
}

void LearnerCore::learn_facts(const ContentHash& task_id, const TaskDescription& facts) {
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    if (task_ids_[c] != task_id) continue;
    const Gmm policy = study_.conditions[c].start.finest();
    if (policy.input_dim() == facts.input_dim && policy.output_dim() == facts.output_dim) {
      continue;
    }
    failure_ = fmt::format(
        "condition {}: the task takes {} inputs and {} outputs, the policy has {} and {}",
        study_.conditions[c].name, facts.input_dim, facts.output_dim, policy.input_dim(),
        policy.output_dim());
    outcome_ = Outcome::kFailed;
    return;
  }
  facts_[task_id] = facts;
}

void LearnerCore::dispatch(TimePoint now, LearnerEffects& effects) {
  std::vector<Ledger::Assignment> chosen;
  if (outcome_ == Outcome::kRunning && !stop_at_ && !journal_is_behind()) {
    chosen = assign(ledger_, workers_, DispatchFacts{now, rollout_time_s_, &facts_});
  }
  std::vector<protocol::RolloutRequest> requests = ledger_.lease(now, chosen);
  std::vector<protocol::Acknowledgement> acknowledgements;
  for (const protocol::WorkerId id : acknowledgements_due_) {
    const WorkerEntry* worker = workers_.find(id);
    if (worker) acknowledgements.push_back({id, worker->acknowledged});
  }
  acknowledgements_due_.clear();
  for (protocol::RolloutBatch& batch :
       pack(std::move(requests), acknowledgements, settings_.batch_bytes_max)) {
    batch.learner_id = settings_.learner_id;
    batch.sequence = ++last_batch_;
    for (const protocol::RolloutRequest& request : batch.rollouts) {
      ledger_.set_batch(request.key, batch.sequence);
    }
    effects.send.emplace_back(std::move(batch));
  }
}

void LearnerCore::publish_task(const ContentHash& id, TimePoint now, LearnerEffects& effects) {
  if (!tasks_.may_publish(id, now)) return;
  effects.send.emplace_back(protocol::TaskDefinition{settings_.learner_id, id, *tasks_.find(id)});
}

void LearnerCore::publish_policy(const ContentHash& id, TimePoint now, LearnerEffects& effects) {
  if (!policies_.may_publish(id, now)) return;
  effects.send.emplace_back(
      protocol::PolicyDefinition{settings_.learner_id, id, *policies_.find(id)});
}

int LearnerCore::numeric_class(const std::string& name) {
  const bool is_full = numeric_classes_.size() >= protocol::kNumericClassesMax;
  if (is_full && !numeric_classes_.contains(name)) return kUnknownClass;
  return numeric_classes_.emplace(name, static_cast<int>(numeric_classes_.size())).first->second;
}

LedgerCounters LearnerCore::counters() const {
  LedgerCounters counters = ledger_.counters;
  for (const Run& run : runs_) counters.failed += run.num_failed();
  counters.pending = counters.issued - counters.applied;
  return counters;
}

std::vector<RunRecord> LearnerCore::run_records() const {
  std::vector<RunRecord> records;
  records.reserve(runs_.size());
  for (const Run& run : runs_) records.push_back(run.record());
  return records;
}

}  // namespace treeroll
