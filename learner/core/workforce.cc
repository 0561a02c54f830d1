#include "learner/core/workforce.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/cut_text.h"
#include "common/base/task_agreement.h"
#include "common/protocol/timings.h"
#include "learner/core/batching.h"
#include "learner/core/dispatch.h"

namespace treeroll::learner {
namespace {

/// A worker that has refused a definition is asked again after this: the reason may have passed.
constexpr Duration kRefusalLasts = std::chrono::seconds(60);

}  // namespace

Workforce::Workforce(LearnerSettings settings, Client& client)
    : settings_(std::move(settings)), client_(client), classes_(settings_.numeric_class) {}

ContentHash Workforce::add_task(const std::string& content) {
  const ContentHash id = tasks_.add(content);
  task_ids_.push_back(id);
  const auto known = settings_.known_tasks.find(content);
  if (known != settings_.known_tasks.end()) facts_[id] = known->second;
  return id;
}

ContentHash Workforce::add_policy(const Turn& turn, const std::string& content) {
  const ContentHash id = policies_.add(content);
  publish_policy(turn, id);
  return id;
}

void Workforce::start(const Turn& turn) {
  last_progress_ = turn.now;
  for (const ContentHash& id : task_ids_) publish_task(turn, id);
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
  const std::optional<TimePoint> lease = ledger_.next_deadline();
  const std::optional<TimePoint> look = workers_.next_look();
  if (!lease || !look) return lease ? lease : look;
  return std::min(*lease, *look);
}

void Workforce::look_after_leases(const Turn& turn) {
  for (const WorkerEntry& silent : workers_.remove_silent(turn.now)) {
    turn.warn(
        "workers that leave",
        fmt::format("{} has left: silent for {:.0f} s, {} roll-outs taken back", describe(silent),
                    to_seconds(protocol::kWorkerSilence), ledger_.leases_of(silent.id).size()));
    ledger_.take_back_all(silent.id);
  }
  ledger_.expire(turn.now);
}

void Workforce::remind(const Turn& turn) {
  workers_.forget_refusals(turn.now);
  refuses_workers_ = refuses_workers_ && workers_.is_full();
  publish_undescribed_tasks(turn);
}

void Workforce::note_sync() {
  num_unsynced_ = 0;
  for (const protocol::WorkerId id : answers_unsynced_) {
    if (WorkerEntry* worker = workers_.find(id)) {
      worker->last_index_acknowledged = worker->last_index_read;
    }
  }
  acknowledgements_due_.merge(answers_unsynced_);
  answers_unsynced_.clear();
}

void Workforce::dispatch(const Turn& turn) {
  std::vector<Ledger::Assignment> chosen;
  if (gives_out_ && !journal_is_behind()) {
    chosen = assign(ledger_, workers_, DispatchFacts{turn.now, rollout_time_s_, &facts_});
  }
  std::vector<protocol::RolloutRequest> requests = ledger_.lease(turn.now, chosen);
  std::vector<protocol::Acknowledgement> acknowledgements;
  for (const protocol::WorkerId id : acknowledgements_due_) {
    const WorkerEntry* worker = workers_.find(id);
    if (worker) acknowledgements.push_back({id, worker->last_index_acknowledged});
  }
  acknowledgements_due_.clear();
  for (protocol::RolloutBatch& batch :
       pack(std::move(requests), acknowledgements, settings_.batch_bytes_max)) {
    batch.learner_id = settings_.learner_id;
    batch.sequence = ++last_batch_;
    for (const protocol::RolloutRequest& request : batch.rollouts) {
      ledger_.set_batch(request.key, batch.sequence);
    }
    turn.effects.emplace_back(SendMessage{std::move(batch)});
  }
}

/// The entry of a worker that has said something; null if there is room for no more workers.
WorkerEntry* Workforce::hear(const Turn& turn, protocol::WorkerId id) {
  WorkerEntry* worker = workers_.hear(id, turn.now);
  if (worker || refuses_workers_) return worker;
  refuses_workers_ = true;
  turn.warn("workers refused",
            fmt::format("worker {} is refused, and so are others until one leaves: {} workers are "
                        "the most that are served",
                        id, protocol::kWorkersMax));
  return nullptr;
}

void Workforce::on(const Turn& turn, const protocol::WorkerStatus& status) {
  WorkerEntry* worker = hear(turn, status.worker_id);
  if (!worker) return;
  const bool is_new = worker->num_evaluators == 0;
  const bool starts_draining = status.draining && !worker->draining;
  worker->host = status.host;
  worker->pid = status.pid;
  worker->numeric_class = cut_text(status.numeric_class, protocol::kNumericClassBytesMax);
  worker->num_evaluators = status.num_evaluators;
  worker->free_slots = status.free_slots;
  worker->receive_buffer_bytes = status.receive_buffer_bytes;
  worker->draining = status.draining;
  if (is_new) {
    turn.inform("workers that join", fmt::format("{} has joined with {} evaluators",
                                                 describe(*worker), worker->num_evaluators));
    publish_undescribed_tasks(turn);
  }
  compare_with_demand(turn, *worker);
  if (starts_draining) {
    turn.inform("workers that drain", fmt::format("{} takes no more roll-outs", describe(*worker)));
  }
  const auto held = std::find_if(
      status.held.begin(), status.held.end(),
      [this](const protocol::HeldRollouts& h) { return h.learner_id == settings_.learner_id; });
  if (held == status.held.end()) return;
  extend_leases(turn.now, *worker, held->keys);
  if (held->last_index <= worker->last_index_read) {
    reconcile(turn.now, *worker, held->last_batch, held->keys);
  }
}

void Workforce::on(const Turn& turn, const protocol::DefinitionRequest& request) {
  if (request.learner_id != settings_.learner_id) return;
  if (!hear(turn, request.worker_id)) return;
  for (const ContentHash& id : request.task_ids) publish_task(turn, id);
  for (const ContentHash& id : request.policy_ids) publish_policy(turn, id);
}

void Workforce::on(const Turn& turn, const protocol::DefinitionReport& report) {
  if (report.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = hear(turn, report.worker_id);
  if (!worker) return;
  const bool is_task = tasks_.find(report.definition_id) != nullptr;
  if (!is_task && !policies_.find(report.definition_id)) return;
  if (!report.accepted) return refuse(turn, *worker, report.definition_id, report.text);
  worker->refused.erase(report.definition_id);
  if (!is_task) return;
  Result<TaskDescription> facts = task_description_from_json(report.text);
  // Its own description makes no sense: another worker's may.
  if (!facts) return refuse(turn, *worker, report.definition_id, facts.error().message);
  if (const TaskDescription* known = facts_of(report.definition_id)) {
    const std::optional<std::string> difference = disagreement(*known, *facts);
    if (difference) refuse(turn, *worker, report.definition_id, *difference);
    return;
  }
  if (client_.take_facts(turn, report.definition_id, *facts)) {
    facts_[report.definition_id] = *facts;
  }
}

void Workforce::refuse(const Turn& turn, WorkerEntry& worker, const ContentHash& definition,
                       const std::string& reason) {
  const bool is_new = !worker.refused.contains(definition);
  if (is_new && worker.refuses_too_much()) return;
  worker.refused[definition] = {cut_text(reason, protocol::kReasonBytesMax),
                                turn.now + kRefusalLasts};
  if (!is_new) return;
  turn.warn("definitions refused", fmt::format("{} refuses the {}: {}", describe(worker),
                                               tasks_.find(definition) ? "task" : "policy",
                                               worker.refused[definition].reason));
  const std::set<protocol::RolloutKey> leases = ledger_.leases_of(worker.id);
  for (const protocol::RolloutKey key : leases) {
    const Question& question = ledger_.find(key)->question;
    if (question.task_id == definition || question.policy_id == definition) ledger_.take_back(key);
  }
}

void Workforce::publish_task(const Turn& turn, const ContentHash& id) {
  if (!tasks_.may_publish(id, turn.now)) return;
  turn.effects.emplace_back(
      SendMessage{protocol::TaskDefinition{settings_.learner_id, id, *tasks_.find(id)}});
}

void Workforce::publish_undescribed_tasks(const Turn& turn) {
  for (const ContentHash& id : task_ids_) {
    if (!facts_.contains(id)) publish_task(turn, id);
  }
}

void Workforce::publish_policy(const Turn& turn, const ContentHash& id) {
  if (!policies_.may_publish(id, turn.now)) return;
  turn.effects.emplace_back(
      SendMessage{protocol::PolicyDefinition{settings_.learner_id, id, *policies_.find(id)}});
}

const TaskDescription* Workforce::facts_of(const ContentHash& task_id) const {
  const auto known = facts_.find(task_id);
  return known == facts_.end() ? nullptr : &known->second;
}

std::optional<std::string> Workforce::refused_by_all(const ContentHash& definition) const {
  std::optional<std::string> reason;
  for (const auto& [id, worker] : workers_.all()) {
    if (!worker.usable()) continue;
    const auto refused = worker.refused.find(definition);
    if (refused == worker.refused.end()) return std::nullopt;
    reason = refused->second.reason;
  }
  return reason;
}

}  // namespace treeroll::learner
