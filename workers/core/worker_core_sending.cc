#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/protocol/wire_sizes.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// A batch says all that is held, or the learner would take the rest for lost. However much that
/// is, so many results go along, or a long queue on a network of small frames would stop them.
constexpr std::size_t kResultBytesMin = 16 * protocol::rollout_result_bytes(0);

}  // namespace

/// What the results take that go along in an answer to this learner.
std::size_t WorkerCore::result_bytes_max(protocol::LearnerId id) const {
  const std::size_t fixed = protocol::kFrameBytesMax + protocol::kRewardBatchBytes +
                            protocol::kRolloutKeyBytes * queue_.of_learner(id).size();
  const std::size_t room = settings_.batch_bytes_max - std::min(settings_.batch_bytes_max, fixed);
  return std::max(room, kResultBytesMin);
}

void WorkerCore::send_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner) {
  protocol::RewardBatch batch{.worker_id = settings_.worker_id,
                              .learner_id = id,
                              .last_batch = learner.last_batch(),
                              .free_slots = free_slots(),
                              .first_index = answers_.first_index(id),
                              .last_index = answers_.last_index(id),
                              .results = answers_.unacknowledged(id, result_bytes_max(id)),
                              .held = queue_.keys(id)};
  if (batch.results.empty()) return learner.on_sent(turn.now, std::nullopt);
  const auto num_results = static_cast<std::int64_t>(batch.results.size());
  learner.on_sent(turn.now, batch.first_index + num_results - 1);
  turn.effects.emplace_back(SendMessage{std::move(batch)});
}

/// Asks for what waiting roll-outs lack, unless all of it was asked for just now, and lets go of
/// those that have waited too long.
void WorkerCore::ask_for_definitions(const Turn& turn, protocol::LearnerId id,
                                     LearnerLink& learner) {
  std::set<DefinitionName> missing;
  for (const RolloutName& name : queue_.of_learner(id)) {
    const HeldRollout& held = *queue_.find(name);
    if (held.state != RolloutState::kWaiting) continue;
    const DefinitionName task{DefinitionKind::kTask, held.request.task_id};
    const DefinitionName policy{DefinitionKind::kPolicy, held.request.policy_id};
    const bool lacks_task = definitions_.find(task) == nullptr;
    const bool lacks_policy = definitions_.find(policy) == nullptr;
    if (!lacks_task && !lacks_policy) continue;
    if (turn.now >= held.since + settings_.definition_wait_max) {
      turn.warn("roll-outs let go",
                fmt::format("lets roll-out {} of run {} go: its {} did not come in {:.0f} s",
                            name.key.number, name.key.run, lacks_task ? "task" : "policy",
                            to_seconds(settings_.definition_wait_max)));
      queue_.remove(name);
      continue;
    }
    if (lacks_task) missing.insert(task);
    if (lacks_policy) missing.insert(policy);
  }
  if (!learner.ask(turn.now, missing)) return;
  protocol::DefinitionRequest request{
      .worker_id = settings_.worker_id, .learner_id = id, .task_ids = {}, .policy_ids = {}};
  const std::size_t room =
      settings_.batch_bytes_max - protocol::kFrameBytesMax - protocol::kDefinitionRequestBytes;
  const std::size_t num_max = std::min(room / protocol::kContentHashBytes,
                                       std::size_t{protocol::kDefinitionsPerRequestMax});
  for (const DefinitionName& name : missing) {
    if (request.task_ids.size() + request.policy_ids.size() == num_max) break;
    auto& ids = name.kind == DefinitionKind::kTask ? request.task_ids : request.policy_ids;
    ids.push_back(name.id);
  }
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
                                .num_restarts = evaluators_.num_restarts(),
                                .num_rejected = num_rejected_ + definitions_.num_rejected(),
                                .held = {}};
  for (const auto& [id, learner] : learners_) {
    protocol::HeldRollouts held{.learner_id = id,
                                .last_batch = learner.last_batch(),
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
  if (draining_ || !evaluators_.any_living()) return 0;
  const int capacity = std::min(settings_.num_evaluators * settings_.held_per_evaluator_max,
                                protocol::kHeldPerMessageMax);
  return capacity - static_cast<int>(queue_.size());
}

}  // namespace treeroll::worker
