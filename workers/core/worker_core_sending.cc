#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

// Sizes on the wire: see lcmtypes. A channel name and the datagram's own header included.
constexpr std::size_t kBatchHeaderBytes = 160;
constexpr std::size_t kHeldBytes = 8;
constexpr std::size_t kResultBytes = 37;
constexpr std::size_t kHashBytes = 16;
/// A batch says all that is held, or the learner would take the rest for lost. However much that
/// is, so many results go along, or a long queue on a network of small frames would stop them.
constexpr std::size_t kResultsPerBatchMin = 16;
/// At 30 % loss each way so many fail in a row less than once in two hundred times.
constexpr int kHastyRepeatsMax = 8;

}  // namespace

void WorkerCore::send_reports(const Turn& turn) {
  for (auto& [key, report] : reports_) {
    turn.effects.emplace_back(SendMessage{std::move(report)});
  }
  reports_.clear();
}

std::size_t WorkerCore::num_results_max(std::size_t num_held) const {
  const std::size_t fixed = kBatchHeaderBytes + kHeldBytes * num_held;
  const std::size_t room =
      settings_.batch_bytes_max > fixed ? (settings_.batch_bytes_max - fixed) / kResultBytes : 0;
  return std::clamp(room, kResultsPerBatchMin, std::size_t{protocol::kResultsPerBatchMax});
}

void WorkerCore::send_answers(const Turn& turn, protocol::LearnerId id, Learner& learner) {
  learner.answers_due = false;
  learner.repeat_at.reset();
  protocol::RewardBatch batch{.worker_id = settings_.worker_id,
                              .learner_id = id,
                              .last_batch = learner.last_batch,
                              .free_slots = free_slots(),
                              .first_index = answers_.first_index(id),
                              .last_index = answers_.last_index(id),
                              .results = {},
                              .held = queue_.keys(id)};
  batch.results = answers_.unacknowledged(id, num_results_max(batch.held.size()));
  if (batch.results.empty()) return;
  const auto num_results = static_cast<std::int64_t>(batch.results.size());
  learner.last_sent_index = std::max(learner.last_sent_index, batch.first_index + num_results - 1);
  learner.repeat_interval = std::max(learner.repeat_interval, settings_.repeat_interval_min);
  learner.repeat_at = turn.now + learner.repeat_interval;
  turn.effects.emplace_back(SendMessage{std::move(batch)});
}

/// Answers that find no room in a batch wait for an acknowledgement, so it is asked for some times
/// without backing off; not for ever, since a learner may have died or stall.
bool WorkerCore::in_haste(protocol::LearnerId id, const Learner& learner) const {
  return learner.num_hasty < kHastyRepeatsMax && learner.last_sent_index < answers_.last_index(id);
}

void WorkerCore::hurry_if_full(const Turn& turn, protocol::LearnerId id, Learner& learner) {
  if (!learner.repeat_at || !in_haste(id, learner)) return;
  learner.repeat_at = std::min(*learner.repeat_at, turn.now + settings_.repeat_interval_min);
}

void WorkerCore::back_off(protocol::LearnerId id, Learner& learner) const {
  if (in_haste(id, learner)) {
    ++learner.num_hasty;
    learner.repeat_interval = settings_.repeat_interval_min;
  } else {
    learner.repeat_interval = std::min(2 * learner.repeat_interval, settings_.repeat_interval_max);
  }
}

/// Asks for what waiting roll-outs lack, unless all of it was asked for just now, and lets go of
/// those that have waited too long.
void WorkerCore::ask_for_definitions(const Turn& turn, protocol::LearnerId id, Learner& learner) {
  learner.asking = false;
  std::set<DefinitionName> missing;
  for (const RolloutName& name : queue_.of_learner(id)) {
    const HeldRollout& held = *queue_.find(name);
    if (held.state != RolloutState::kWaiting) continue;
    const bool lacks_task = tasks_.find(held.request.task_id) == nullptr;
    const bool lacks_policy = policies_.find(held.request.policy_id) == nullptr;
    if (!lacks_task && !lacks_policy) continue;
    if (turn.now >= held.since + settings_.definition_wait_max) {
      turn.log(true, "roll-outs let go",
               fmt::format("lets roll-out {} of run {} go: its {} did not come in {:.0f} s",
                           name.key.number, name.key.run, lacks_task ? "task" : "policy",
                           to_seconds(settings_.definition_wait_max)));
      queue_.remove(name);
      continue;
    }
    if (lacks_task) missing.insert({DefinitionKind::kTask, held.request.task_id});
    if (lacks_policy) missing.insert({DefinitionKind::kPolicy, held.request.policy_id});
  }
  if (missing.empty()) {
    learner.ask_at.reset();
    learner.asked.clear();
    return;
  }
  const bool due = !learner.ask_at || turn.now >= *learner.ask_at;
  if (!due &&
      std::includes(learner.asked.begin(), learner.asked.end(), missing.begin(), missing.end())) {
    return;
  }
  protocol::DefinitionRequest request{
      .worker_id = settings_.worker_id, .learner_id = id, .task_ids = {}, .policy_ids = {}};
  const std::size_t num_max = std::min((settings_.batch_bytes_max - kBatchHeaderBytes) / kHashBytes,
                                       std::size_t{protocol::kDefinitionsPerRequestMax});
  for (const DefinitionName& name : missing) {
    if (request.task_ids.size() + request.policy_ids.size() == num_max) break;
    auto& ids = name.kind == DefinitionKind::kTask ? request.task_ids : request.policy_ids;
    ids.push_back(name.id);
  }
  learner.asked = std::move(missing);
  learner.ask_at = turn.now + settings_.ask_interval;
  turn.effects.emplace_back(SendMessage{std::move(request)});
}

void WorkerCore::send_status(const Turn& turn) {
  protocol::WorkerStatus status{.worker_id = settings_.worker_id,
                                .host = settings_.host,
                                .pid = settings_.pid,
                                .version = settings_.version,
                                .numeric_class = settings_.numeric_class,
                                .num_evaluators = settings_.num_evaluators,
                                .free_slots = free_slots(),
                                .draining = draining_,
                                .num_evaluated = num_evaluated_,
                                .num_failed = num_failed_,
                                .num_repeated = num_repeated_,
                                .num_restarts = num_restarts_,
                                .num_rejected = num_rejected_,
                                .held = {}};
  for (const auto& [id, learner] : learners_) {
    protocol::HeldRollouts held{.learner_id = id,
                                .last_batch = learner.last_batch,
                                .last_index = answers_.last_index(id),
                                .keys = queue_.keys(id)};
    status.held.push_back(std::move(held));
  }
  status_due_ = false;
  heartbeat_at_ =
      turn.now + (queue_.size() > 0 ? settings_.busy_heartbeat : settings_.idle_heartbeat);
  turn.effects.emplace_back(SendMessage{std::move(status)});
}

/// Room is where an evaluator lives: what is taken without one would be kept from other workers.
int WorkerCore::free_slots() const {
  if (draining_ || !any_living()) return 0;
  const int capacity = std::min(settings_.num_evaluators * settings_.held_per_evaluator_max,
                                protocol::kHeldPerMessageMax);
  return capacity - static_cast<int>(queue_.size());
}

}  // namespace treeroll::worker
