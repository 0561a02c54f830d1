#include "learner/core/learner_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "common/base/check.h"
#include "learner/core/batching.h"
#include "learner/core/dispatch.h"

namespace treeroll {
namespace {

constexpr Duration kStatusPeriod = std::chrono::seconds(1);
/// A worker repeats an unacknowledged answer every 20 ms: what a heartbeat does not list may still
/// be on its way that long.
constexpr Duration kAnswerOnItsWay = std::chrono::milliseconds(50);

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
  if (outcome_ != Outcome::kRunning) return;
  std::visit(
      [&](const auto& what) {
        using What = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<What, learner_event::Started>) {
          on_started(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::InboxDrained>) {
          dispatch(now, effects);
        } else if constexpr (std::is_same_v<What, learner_event::Timer>) {
          on_timer(now, effects);
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
  if (const auto silence = workers_.next_silence()) next = std::min(next, *silence);
  return next;
}

void LearnerCore::on_timer(TimePoint now, LearnerEffects& effects) {
  for (const WorkerEntry& silent : workers_.remove_silent(now)) {
    effects.log.push_back(
        {LogLine::Level::kWarning,
         fmt::format("{} has left: silent for {:.0f} s, {} roll-outs taken back", describe(silent),
                     to_seconds(WorkerTable::kSilence), silent.leases.size())});
    for (const protocol::RolloutKey key : silent.leases) ledger_.take_back(key);
  }
  for (const auto& [key, worker] : ledger_.expire(now)) {
    if (WorkerEntry* entry = workers_.find(worker)) entry->leases.erase(key);
  }
  if (now >= next_status_) {
    for (const ContentHash& task_id : task_ids_) {
      if (!facts_.contains(task_id)) publish_task(task_id, now, effects);
    }
    publish_status(now, effects);
    next_status_ = now + kStatusPeriod;
  }
  dispatch(now, effects);
}

void LearnerCore::on_message(const protocol::RewardBatch& batch, TimePoint now,
                             LearnerEffects& effects) {
  if (batch.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = workers_.hear(batch.worker_id, now);
  if (!worker) return;
  for (std::size_t i = 0; i < batch.results.size(); ++i) {
    const std::int64_t index = batch.first_index + static_cast<std::int64_t>(i);
    if (index <= worker->acknowledged) continue;  // a repetition of what was settled
    accept(*worker, batch.results[i], now, effects);
    if (outcome_ == Outcome::kFailed) return;
  }
  if (!batch.results.empty()) {
    const std::int64_t last =
        batch.first_index + static_cast<std::int64_t>(batch.results.size()) - 1;
    worker->acknowledged = std::max(worker->acknowledged, last);
    worker->acknowledgement_due = true;
  }
  if (outcome_ == Outcome::kDone) return dispatch(now, effects);  // the last acknowledgement
  worker->free_slots = batch.free_slots;
  reconcile(*worker, batch.last_batch, batch.held, now, now);
}

void LearnerCore::on_message(const protocol::WorkerStatus& status, TimePoint now,
                             LearnerEffects& effects) {
  WorkerEntry* worker = workers_.hear(status.worker_id, now);
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
    effects.log.push_back(
        {LogLine::Level::kInfo, fmt::format("{} has joined with {} evaluators", describe(*worker),
                                            worker->num_evaluators)});
    for (const ContentHash& task_id : task_ids_) {
      if (!facts_.contains(task_id)) publish_task(task_id, now, effects);
    }
  }
  if (starts_draining) {
    effects.log.push_back(
        {LogLine::Level::kInfo, fmt::format("{} takes no more roll-outs", describe(*worker))});
  }
  const auto held = std::find_if(
      status.held.begin(), status.held.end(),
      [this](const protocol::HeldRollouts& h) { return h.learner_id == settings_.learner_id; });
  if (held != status.held.end()) {
    reconcile(*worker, held->last_batch, held->keys, now, now + kAnswerOnItsWay);
  }
}

void LearnerCore::on_message(const protocol::DefinitionRequest& request, TimePoint now,
                             LearnerEffects& effects) {
  if (request.learner_id != settings_.learner_id) return;
  if (!workers_.hear(request.worker_id, now)) return;
  for (const ContentHash& id : request.task_ids) publish_task(id, now, effects);
  for (const ContentHash& id : request.policy_ids) publish_policy(id, now, effects);
}

void LearnerCore::on_message(const protocol::DefinitionReport& report, TimePoint now,
                             LearnerEffects& effects) {
  if (report.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = workers_.hear(report.worker_id, now);
  if (!worker) return;
  const bool is_task = tasks_.find(report.definition_id) != nullptr;
  if (!is_task && !policies_.find(report.definition_id)) return;
  if (report.accepted) {
    worker->refused.erase(report.definition_id);
    if (is_task && !facts_.contains(report.definition_id)) {
      learn_facts(report.definition_id, report.text);
    }
    return;
  }
  if (!worker->refused.emplace(report.definition_id, report.text).second) return;
  effects.log.push_back(
      {LogLine::Level::kWarning, fmt::format("{} refuses the {}: {}", describe(*worker),
                                             is_task ? "task" : "policy", report.text)});
  const std::set<protocol::RolloutKey> leases = worker->leases;
  for (const protocol::RolloutKey key : leases) {
    const Question& question = ledger_.find(key)->question;
    if (question.task_id == report.definition_id || question.policy_id == report.definition_id) {
      take_back(*worker, key);
    }
  }
}

void LearnerCore::learn_facts(const ContentHash& task_id, const std::string& description) {
  Result<TaskFacts> facts = task_facts_from_json(description);
  if (!facts) {
    failure_ = "a worker's description of the task cannot be used: " + facts.error().message;
    outcome_ = Outcome::kFailed;
    return;
  }
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    if (task_ids_[c] != task_id) continue;
    const Gmm policy = study_.conditions[c].start.finest();
    if (policy.input_dim() == facts->input_dim && policy.output_dim() == facts->output_dim) {
      continue;
    }
    failure_ = fmt::format(
        "condition {}: the task takes {} inputs and {} outputs, the policy has {} and {}",
        study_.conditions[c].name, facts->input_dim, facts->output_dim, policy.input_dim(),
        policy.output_dim());
    outcome_ = Outcome::kFailed;
    return;
  }
  facts_[task_id] = *facts;
}

void LearnerCore::dispatch(TimePoint now, LearnerEffects& effects) {
  const std::vector<Ledger::Assignment> chosen =
      assign(ledger_, workers_, DispatchFacts{now, rollout_time_s_, &facts_});
  std::vector<protocol::RolloutRequest> requests = ledger_.lease(now, chosen);
  std::vector<protocol::Acknowledgement> acknowledgements;
  for (auto& [id, worker] : workers_.all()) {
    if (!worker.acknowledgement_due) continue;
    acknowledgements.push_back({id, worker.acknowledged});
    worker.acknowledgement_due = false;
  }
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
  return numeric_classes_.emplace(name, static_cast<int>(numeric_classes_.size())).first->second;
}

LedgerCounters LearnerCore::counters() const {
  LedgerCounters counters = ledger_.counters;
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
