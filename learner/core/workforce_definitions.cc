#include <fmt/format.h>

#include <set>
#include <utility>

#include "common/base/cut_text.h"
#include "common/protocol/pieces.h"
#include "common/protocol/wire_sizes.h"
#include "common/task_facts/task_description.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {
ContentHash Workforce::add_task(const std::string& content) {
  const ContentHash id = definitions_.add(protocol::DefinitionKind::kTask, content);
  task_ids_.push_back(id);
  const auto known = settings_.known_tasks.find(content);
  if (known != settings_.known_tasks.end()) facts_[id] = known->second;
  return id;
}

ContentHash Workforce::add_policy(const Turn& turn, const std::string& content) {
  const ContentHash id = definitions_.add(protocol::DefinitionKind::kPolicy, content);
  definitions_.publish(policy_name(id), turn.now);
  return id;
}

void Workforce::send_definitions(const Turn& turn) {
  for (protocol::DefinitionPiece& piece : definitions_.take_due(settings_.learner_id, turn.now)) {
    turn.effects.emplace_back(SendMessage{std::move(piece)});
  }
}

void Workforce::publish_undescribed_tasks(TimePoint now) {
  for (const ContentHash& id : task_ids_) {
    if (!facts_.contains(id)) definitions_.publish(task_name(id), now);
  }
}

/// A theta that no message has room for travels as a definition does. It is sent with the first
/// request; after that its worker asks for what it lacks.
void Workforce::detach_theta(TimePoint now, protocol::RolloutRequest& request) {
  const std::size_t bytes = protocol::kFrameBytesMax + protocol::kRolloutBatchBytes +
                            settings_.word_bytes +
                            protocol::rollout_request_bytes(request.theta.size());
  if (bytes <= settings_.batch_bytes_max) return;
  constexpr auto kTheta = protocol::DefinitionKind::kTheta;
  const auto [place, is_new] = thetas_.try_emplace(request.key);
  if (is_new) {
    place->second = definitions_.add(kTheta, protocol::content_of_theta(request.theta));
    definitions_.publish({kTheta, place->second}, now);
  }
  request.theta.clear();
  request.theta_id = place->second;
}

void Workforce::on(const Turn& turn, const protocol::DefinitionRequest& request) {
  if (request.learner_id != settings_.learner_id) return;
  if (!hear(turn, request.worker_id)) return;
  for (const protocol::WantedDefinition& wanted : request.definitions) {
    definitions_.publish_wanted(wanted, turn.now);
  }
}

void Workforce::on(const Turn& turn, const protocol::DefinitionReport& report) {
  if (report.learner_id != settings_.learner_id) return;
  WorkerEntry* worker = hear(turn, report.worker_id);
  if (!worker) return;
  const bool is_task = definitions_.find(task_name(report.definition_id)) != nullptr;
  if (!is_task && !definitions_.find(policy_name(report.definition_id))) return;
  // Who has not answered a greeting may be anybody: it is asked again once it has.
  if (!worker->hearing.hears()) return;
  if (!report.accepted) return refuse(turn, *worker, report.definition_id, report.text);
  if (!is_task) {
    worker->refused.erase(report.definition_id);
    return;
  }
  Result<TaskDescription> facts = task_description_from_json(report.text);
  // Its own description makes no sense: another worker's may.
  if (!facts) return refuse(turn, *worker, report.definition_id, facts.error().message);
  take_description(turn, *worker, report.definition_id, *facts);
}

void Workforce::refuse(const Turn& turn, WorkerEntry& worker, const ContentHash& definition,
                       const std::string& reason) {
  const bool is_new = !worker.refused.contains(definition);
  if (is_new && worker.refuses_too_much()) return;
  WorkerEntry::Refusal& refusal = worker.refused[definition];
  refusal.reason = cut_text(reason, protocol::kReasonBytesMax);
  refusal.until = turn.now + kRefusalLasts;
  if (!is_new) return;
  turn.warn(
      "definitions refused",
      fmt::format("{} refuses the {}: {}", describe(worker),
                  definitions_.find(task_name(definition)) ? "task" : "policy", refusal.reason));
  const std::set<protocol::RolloutKey> leases = ledger_.leases_of(worker.id);
  for (const protocol::RolloutKey key : leases) {
    const Ledger::Entry& entry = *ledger_.find(key);
    const Question& question = entry.question;
    const bool needs_it = question.task_id == definition || question.policy_id == definition;
    // Anybody may have said it in its name: of what it has said to hold its next status tells.
    const bool is_waited_for = !worker.is_known && entry.lease_of(worker.id)->confirmed;
    if (needs_it && !is_waited_for) ledger_.take_back(key, worker.id);
  }
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
