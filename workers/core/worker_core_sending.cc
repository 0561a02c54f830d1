#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/protocol/wire_sizes.h"
#include "workers/core/held_slice.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// However much is held, a batch has room for so many results: a long queue on a network of small
/// frames would stop them. What is held and finds no room is named by the next batch.
constexpr std::size_t kResultBytesMin = 16 * protocol::rollout_result_bytes(0);

}  // namespace

/// How many roll-outs held a batch of answers has room for beside the least number of results.
std::size_t WorkerCore::num_held_max() const {
  const std::size_t fixed =
      protocol::kFrameBytesMax + protocol::kRewardBatchBytes + kResultBytesMin;
  return (settings_.batch_bytes_max - fixed) / protocol::kRolloutKeyBytes;
}

/// What the results take that go along in an answer to this learner.
std::size_t WorkerCore::result_bytes_max(protocol::LearnerId id) const {
  const std::size_t num_held = std::min(queue_.of_learner(id).size(), num_held_max());
  const std::size_t fixed = protocol::kFrameBytesMax + protocol::kRewardBatchBytes +
                            protocol::kRolloutKeyBytes * num_held;
  return settings_.batch_bytes_max - fixed;
}

void WorkerCore::send_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner) {
  HeldSlice held = slice_of(queue_.keys(id), learner.held_from, num_held_max());
  protocol::RewardBatch batch{.worker_id = settings_.worker_id,
                              .learner_id = id,
                              .last_batch = learner.last_batch(),
                              .free_slots = free_slots(),
                              .first_index = answers_.first_index(id),
                              .last_index = answers_.last_index(id),
                              .results = answers_.unacknowledged(id, result_bytes_max(id)),
                              .held = std::move(held.keys),
                              .held_first = held.first,
                              .held_last = held.last};
  if (batch.results.empty()) return learner.on_sent(turn.now, std::nullopt);
  learner.held_from = held.next();
  const auto num_results = static_cast<std::int64_t>(batch.results.size());
  learner.on_sent(turn.now, batch.first_index + num_results - 1);
  turn.effects.emplace_back(SendMessage{std::move(batch)});
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
