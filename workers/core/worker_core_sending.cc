#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "common/protocol/wire_sizes.h"
#include "workers/core/held_slice.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// However much is held, a batch has room for so many results: a long queue on a network of small
/// frames would stop them. What is held and finds no room is named by the next batch.
constexpr std::size_t kResultsPerBatchMin = 16;
/// Requests for definitions in one go; what finds no room in them is asked for next time.
constexpr int kRequestsPerAskMax = 4;

/// Names what is missing in as few messages as hold it.
class RequestWriter {
 public:
  RequestWriter(protocol::DefinitionRequest empty, std::size_t bytes_max)
      : empty_(std::move(empty)),
        room_max_(bytes_max - protocol::kFrameBytesMax - protocol::kDefinitionRequestBytes) {}

  /// False if there is no room left for all of it.
  bool add(const DefinitionName& name, std::span<const std::int32_t> pieces) {
    do {
      const bool fits =
          !requests_.empty() && room_ >= protocol::wanted_definition_bytes(1) &&
          requests_.back().definitions.size() < std::size_t{protocol::kDefinitionsPerRequestMax};
      if (!fits && !begin()) return false;
      const std::size_t num_fit =
          std::min(pieces.size(), (room_ - protocol::wanted_definition_bytes(0)) / 4);
      const auto some = pieces.first(num_fit);
      requests_.back().definitions.push_back({name, {some.begin(), some.end()}});
      room_ -= protocol::wanted_definition_bytes(num_fit);
      pieces = pieces.subspan(num_fit);
    } while (!pieces.empty());
    return true;
  }

  std::vector<protocol::DefinitionRequest>& requests() { return requests_; }

 private:
  bool begin() {
    if (requests_.size() == kRequestsPerAskMax) return false;
    requests_.push_back(empty_);
    room_ = room_max_;
    return true;
  }

  protocol::DefinitionRequest empty_;
  std::size_t room_max_;
  std::size_t room_ = 0;
  std::vector<protocol::DefinitionRequest> requests_;
};

}  // namespace

/// How many roll-outs held a batch of answers has room for beside the least number of results.
std::size_t WorkerCore::num_held_max() const {
  const std::size_t fixed = protocol::kFrameBytesMax + protocol::kRewardBatchBytes +
                            kResultsPerBatchMin * protocol::kRolloutResultBytes;
  return (settings_.batch_bytes_max - fixed) / protocol::kRolloutKeyBytes;
}

/// How many results go along in an answer to this learner.
std::size_t WorkerCore::num_results_max(protocol::LearnerId id) const {
  const std::size_t num_held = std::min(queue_.of_learner(id).size(), num_held_max());
  const std::size_t fixed = protocol::kFrameBytesMax + protocol::kRewardBatchBytes +
                            protocol::kRolloutKeyBytes * num_held;
  return std::min((settings_.batch_bytes_max - fixed) / protocol::kRolloutResultBytes,
                  std::size_t{protocol::kResultsPerBatchMax});
}

void WorkerCore::send_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner) {
  HeldSlice held = slice_of(queue_.keys(id), learner.held_from, num_held_max());
  protocol::RewardBatch batch{.worker_id = settings_.worker_id,
                              .learner_id = id,
                              .last_batch = learner.last_batch(),
                              .free_slots = free_slots(),
                              .first_index = answers_.first_index(id),
                              .last_index = answers_.last_index(id),
                              .results = answers_.unacknowledged(id, num_results_max(id)),
                              .held = std::move(held.keys),
                              .held_first = held.first,
                              .held_last = held.last};
  if (batch.results.empty()) return learner.on_sent(turn.now, std::nullopt);
  learner.held_from = held.next();
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
    if (!lacks_task && !lacks_policy && !held.lacks_theta()) continue;
    if (turn.now >= held.since + settings_.definition_wait_max) {
      turn.warn("roll-outs let go",
                fmt::format("lets roll-out {} of run {} go: its {} did not come in {:.0f} s",
                            name.key.number, name.key.run,
                            lacks_task     ? "task"
                            : lacks_policy ? "policy"
                                           : "theta",
                            to_seconds(settings_.definition_wait_max)));
      queue_.remove(name);
      continue;
    }
    if (lacks_task) missing.insert(task);
    if (lacks_policy) missing.insert(policy);
    if (held.lacks_theta()) missing.insert({DefinitionKind::kTheta, *held.request.theta_id});
  }
  if (!learner.ask(turn.now, missing)) return;
  RequestWriter writer({.worker_id = settings_.worker_id, .learner_id = id, .definitions = {}},
                       settings_.batch_bytes_max);
  for (const DefinitionName& name : missing) {
    if (!writer.add(name, definitions_.missing_pieces(id, name))) break;
  }
  for (protocol::DefinitionRequest& request : writer.requests()) {
    turn.effects.emplace_back(SendMessage{std::move(request)});
  }
}

/// All that is held, in as few messages as hold it.
void WorkerCore::send_status(const Turn& turn) {
  const protocol::WorkerStatus empty{.worker_id = settings_.worker_id,
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
  const std::size_t room_max = settings_.batch_bytes_max - protocol::kFrameBytesMax -
                               protocol::kWorkerStatusBytes - empty.host.size() -
                               empty.version.size() - empty.numeric_class.size();
  constexpr std::size_t kLeastRoom = protocol::kHeldRolloutsBytes + protocol::kRolloutKeyBytes;
  std::vector<protocol::WorkerStatus> statuses{empty};
  std::size_t room = room_max;
  for (const auto& [id, learner] : learners_) {
    const std::vector<protocol::RolloutKey> keys = queue_.keys(id);
    HeldSlice slice;
    do {
      if (room < kLeastRoom) {
        statuses.push_back(empty);
        room = room_max;
      }
      slice = slice_of(keys, slice.next(),
                       (room - protocol::kHeldRolloutsBytes) / protocol::kRolloutKeyBytes);
      room -= protocol::kHeldRolloutsBytes + protocol::kRolloutKeyBytes * slice.keys.size();
      statuses.back().held.push_back({.learner_id = id,
                                      .last_batch = learner.last_batch(),
                                      .last_index = answers_.last_index(id),
                                      .keys = std::move(slice.keys),
                                      .first = slice.first,
                                      .last = slice.last});
    } while (slice.last != protocol::kLastKey);
  }
  status_due_ = false;
  heartbeat_at_ =
      turn.now + (queue_.size() > 0 ? settings_.busy_heartbeat : settings_.idle_heartbeat);
  for (protocol::WorkerStatus& status : statuses) {
    turn.effects.emplace_back(SendMessage{std::move(status)});
  }
}

/// Room is where an evaluator lives: what is taken without one would be kept from other workers.
int WorkerCore::free_slots() const {
  if (draining_ || !evaluators_.any_living()) return 0;
  const int capacity = std::min(settings_.num_evaluators * settings_.held_per_evaluator_max,
                                protocol::kHeldPerMessageMax);
  return capacity - static_cast<int>(queue_.size());
}

}  // namespace treeroll::worker
