#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/protocol/wire_sizes.h"
#include "workers/core/held_slice.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// Of one repetition: a learner that is back is given what it missed in a few of them, one that is
/// not costs the network little.
constexpr int kBatchesPerRepetitionMax = 4;

}  // namespace

/// Bytes of results in a batch.
std::size_t WorkerCore::batch_room() const {
  return settings_.batch_bytes_max - protocol::kFrameBytesMax - protocol::kRewardBatchBytes;
}

/// One batch, from this answer on. @return index of the first that it has no room for
std::int64_t WorkerCore::send_batch(const Turn& turn, protocol::LearnerId id, LearnerLink& learner,
                                    std::int64_t first) {
  protocol::RewardBatch batch{.worker_id = settings_.worker_id,
                              .learner_id = id,
                              .last_batch = learner.last_batch(),
                              .batches_received = learner.batches_received(),
                              .free_slots = free_slots(),
                              .oldest_index = answers_.first_index(id),
                              .first_index = first,
                              .results = answers_.from(id, first, batch_room())};
  const std::int64_t next = first + static_cast<std::int64_t>(batch.results.size());
  learner.take_missing();
  learner.on_sent(turn.now, next - 1);
  turn.effects.emplace_back(SendMessage{std::move(batch)});
  return next;
}

/// How long what is new may wait for what comes: a message costs as much as many results. Not at
/// all where the queue would run dry before more could come, or a batch is full; else for a share
/// of the work that is queued.
Duration WorkerCore::answer_wait(protocol::LearnerId id, const LearnerLink& learner) const {
  const auto num_evaluators = static_cast<double>(std::max(1, evaluators_.count()));
  double work_s = 0;  // of each evaluator; that of a task whose time is not known counts as none
  for (const auto& [task, count] : queue_.tasks()) {
    const Definition* definition = definitions_.find({DefinitionKind::kTask, task});
    if (definition != nullptr) work_s += count * to_seconds(definition->rollout_time);
  }
  work_s /= num_evaluators;
  const std::optional<Duration> round_trip = learner.round_trip();
  const bool runs_dry =
      static_cast<double>(queue_.size()) <= settings_.few_per_evaluator * num_evaluators ||
      !round_trip || work_s <= 2 * to_seconds(*round_trip);
  const auto num_new =
      static_cast<std::size_t>(answers_.last_index(id) - learner.last_index_sent());
  const bool is_full = num_new * protocol::rollout_result_bytes(0) >= batch_room();
  if (draining_ || runs_dry || is_full || learner.loses_batches()) return {};
  return std::min(std::chrono::duration_cast<Duration>(
                      std::chrono::duration<double>(protocol::kAnswerShareOfWork * work_s)),
                  settings_.answer_delay_max);
}

void WorkerCore::send_answers_if_due(const Turn& turn, protocol::LearnerId id,
                                     LearnerLink& learner) {
  if (answers_.last_index(id) > learner.last_index_sent()) {
    learner.answer_after(turn.now, answer_wait(id, learner));
    if (!learner.answer_due(turn.now)) return;
  }
  send_new_answers(turn, id, learner);  // and what is asked for again, which waits for nothing
}

/// Each answer once, in as few batches as have room; and what has been asked for again. Where
/// messages are lost all that has not been seen goes along, if a batch has room for it: what was
/// lost is there again before its absence could show.
void WorkerCore::send_new_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner) {
  const std::int64_t oldest = answers_.first_index(id);
  std::int64_t next = std::max(oldest, learner.last_index_sent() + 1);
  if (const auto again = learner.take_wanted_again()) {
    const std::int64_t last_again = std::min(again->second, learner.last_index_sent());
    std::int64_t at = std::max(oldest, again->first);
    while (at <= last_again) at = send_batch(turn, id, learner, at);
    next = std::max(next, at);
  }
  const std::int64_t last = answers_.last_index(id);
  if (next <= last && learner.loses_batches()) {
    const std::int64_t unseen = std::max(oldest, learner.last_index_seen() + 1);
    const std::size_t num_fit = batch_room() / protocol::rollout_result_bytes(0);
    if (static_cast<std::size_t>(last - unseen) < num_fit) next = std::min(next, unseen);
  }
  while (next <= last) next = send_batch(turn, id, learner, next);
  // What it was asked in them is asked again as soon as it says so.
  const bool runs_dry = queue_.size() < static_cast<std::size_t>(evaluators_.count());
  if (runs_dry && learner.take_missing()) send_batch(turn, id, learner, next);
}

void WorkerCore::repeat_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner) {
  std::int64_t next = learner.begin_repetition(turn.now, answers_.first_index(id));
  const std::int64_t last = learner.last_index_sent();
  for (int i = 0; i < kBatchesPerRepetitionMax && next <= last; ++i) {
    next = send_batch(turn, id, learner, next);
  }
}

/// All that is held, in as few messages as hold it. What it is not said to hold it has answered.
void WorkerCore::send_status(const Turn& turn) {
  for (auto& [id, learner] : learners_) send_new_answers(turn, id, learner);
  const protocol::WorkerStatus empty{.worker_id = settings_.worker_id,
                                     .host = settings_.host,
                                     .pid = settings_.pid,
                                     .version = settings_.version,
                                     .numeric_class = settings_.numeric_class,
                                     .num_evaluators = evaluators_.count(),
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
  heartbeat_at_ = turn.now + heartbeat();
  for (protocol::WorkerStatus& status : statuses) {
    turn.effects.emplace_back(SendMessage{std::move(status)});
  }
}

/// Until the next heartbeat. Who has no learner keeps the pace of the last one: one that starts
/// wakes it.
Duration WorkerCore::heartbeat() const {
  const protocol::Heartbeats beats = protocol::heartbeats_of(num_workers_);
  return queue_.size() > 0 ? beats.busy : beats.idle;
}

void WorkerCore::beat_within(const Turn& turn, Duration interval) {
  heartbeat_at_ = std::min(heartbeat_at_, turn.now + interval);
}

/// Whether a learner that is not served may have a status come sooner. What it says may be made up
/// or a recording, and one datagram is heard by all workers.
bool WorkerCore::takes_wake(TimePoint now) {
  if (now < wake_at_) return false;
  wake_at_ = now + protocol::heartbeats_of(num_workers_).wake;
  return true;
}

/// Each learner counts on heartbeats as often as what it has said allows.
void WorkerCore::count_workers(TimePoint now) {
  std::optional<int> fewest;
  for (const auto& [id, learner] : learners_) {
    const std::optional<int> heard = learner.num_workers(now);
    if (heard) fewest = std::min(*heard, fewest.value_or(*heard));
  }
  num_workers_ = fewest.value_or(num_workers_);
}

/// Room is where an evaluator lives: what is taken without one would be kept from other workers.
int WorkerCore::free_slots() const {
  if (draining_ || !evaluators_.any_living()) return 0;
  const int capacity = std::min(evaluators_.count() * settings_.held_per_evaluator_max,
                                protocol::kHeldPerMessageMax);
  return std::max(0, capacity - static_cast<int>(queue_.size()));
}

}  // namespace treeroll::worker
