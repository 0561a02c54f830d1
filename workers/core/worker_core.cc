#include "workers/core/worker_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/check.h"
#include "workers/core/evaluator_pool.h"

namespace treeroll::worker {
namespace {

constexpr const char* kLeaving = "leaving";

}  // namespace

WorkerCore::WorkerCore(WorkerSettings settings)
    : settings_(std::move(settings)),
      answers_(settings_.num_answers_max),
      definitions_(settings_),
      pool_(std::make_unique<EvaluatorPool>(settings_)),
      evaluators_(*pool_) {
  CHECK(settings_.batch_bytes_max >= protocol::kBatchBytesRemoteMax, "batches too small");
}

WorkerCore::WorkerCore(WorkerSettings settings, Evaluators& evaluators)
    : settings_(std::move(settings)),
      answers_(settings_.num_answers_max),
      definitions_(settings_),
      evaluators_(evaluators) {
  CHECK(settings_.batch_bytes_max >= protocol::kBatchBytesRemoteMax, "batches too small");
}

void WorkerCore::step(TimePoint now, Event event, Effects& effects) {
  if (exited_) return;
  // A deadline that was not served when due shows that this process was stopped or kept waiting,
  // and its evaluators most likely with it (Ctrl-Z, a frozen container).
  const Duration delay = now - std::max(next_deadline(), last_step_);
  last_step_ = now;
  if (delay > Duration{}) {
    evaluators_.excuse(delay);
    busy_at_ += delay;
    for (auto& [id, learner] : learners_) learner.excuse(delay);
  }

  const Turn turn{now, effects, log_limiter_};
  std::visit([&](auto& e) { on(turn, e); }, event);
  if (exited_) return;
  if (queue_.size() > 0) busy_at_ = now;
  if (definitions_.take_settled()) {
    for (const RolloutName& name : queue_.in_state(RolloutState::kWaiting)) review(name);
  }
  assign_work(turn);
}

TimePoint WorkerCore::next_deadline() const {
  if (exited_) return TimePoint::max();
  TimePoint deadline = std::min(heartbeat_at_, evaluators_.next_deadline());
  for (const auto& [id, learner] : learners_) {
    deadline = std::min(deadline, learner.next_deadline());
  }
  if (finish_by_) deadline = std::min(deadline, *finish_by_);
  if (settings_.idle_max && !draining_ && queue_.size() == 0) {
    deadline = std::min(deadline, busy_at_ + *settings_.idle_max);
  }
  return drain_end_ ? std::min(deadline, *drain_end_) : deadline;
}

void WorkerCore::on(const Turn& turn, const Started&) {
  busy_at_ = turn.now;
  evaluators_.start(turn);
  send_status(turn);
}

void WorkerCore::on(const Turn& turn, MessageReceived& event) {
  if (auto* batch = std::get_if<protocol::RolloutBatch>(&event.message)) {
    receive(turn, *batch);
  } else if (const auto* piece = std::get_if<protocol::DefinitionPiece>(&event.message)) {
    // A learner that starts should not have to wait for the next heartbeat.
    const bool begins_task = piece->name.kind == DefinitionKind::kTask && piece->index == 0;
    const bool is_new = begins_task && !learners_.contains(piece->learner_id);
    if (is_new && takes_wake(turn.now)) status_due_ = true;
    const bool is_theta = piece->name.kind == DefinitionKind::kTheta;
    is_theta ? take_theta(turn, *piece) : definitions_.receive(turn, *piece, queue_);
  } else if (const auto* status = std::get_if<protocol::LearnerStatus>(&event.message)) {
    const auto known = learners_.find(status->learner_id);
    if (known == learners_.end()) {
      const bool is_slow = heartbeat_at_ > turn.now + protocol::kIdleHeartbeat;
      if (is_slow && takes_wake(turn.now)) beat_within(turn, protocol::kIdleHeartbeat);
      return;
    }
    known->second.hear_status(turn.now, status->num_workers);
    count_workers(turn.now);
    beat_within(turn, heartbeat());
  }
}

void WorkerCore::on(const Turn& turn, const EvaluatorEvent& event) {
  const bool had_room = evaluators_.any_living();
  const std::vector<WorkEnd> ends = evaluators_.on(turn, event, definitions_);
  note_check(turn.now);
  if (!had_room && evaluators_.any_living()) status_due_ = true;
  for (const WorkEnd& end : ends) conclude(turn, end);
  const bool died = std::holds_alternative<EvaluatorDied>(event);
  if (died && !draining_ && queue_.size() > 0) give_up_in_trouble(turn);
}

void WorkerCore::on(const Turn& turn, const InboxDrained&) {
  definitions_.send_reports(turn);
  for (auto& [id, learner] : learners_) {
    if (learner.looks_for_missing()) ask_for_definitions(turn, id, learner);
    send_answers_if_due(turn, id, learner);
  }
  if (status_due_) send_status(turn);
  leave_if_drained(turn);
}

void WorkerCore::on(const Turn& turn, const TimerFired&) {
  std::vector<protocol::LearnerId> silent;
  for (auto& [id, learner] : learners_) {
    if (learner.is_silent(turn.now)) {
      silent.push_back(id);
      continue;
    }
    if (learner.is_to_be_given_up(turn.now)) {
      learner.give_up();
      count_workers(turn.now);
      give_up_work_of(turn, id);
    }
    if (learner.asking_due(turn.now)) ask_for_definitions(turn, id, learner);
    send_answers_if_due(turn, id, learner);
    if (learner.repetition_due(turn.now)) repeat_answers(turn, id, learner);
  }
  for (const protocol::LearnerId id : silent) {
    turn.inform("learners forgotten",
                fmt::format("learner {} has been silent for {:.0f} s and is forgotten", id,
                            to_seconds(settings_.learner_silence_max)));
    forget(turn, id);
  }
  evaluators_.watch(turn);
  if (turn.now >= heartbeat_at_) {
    turn.log_due();
    send_status(turn);
  }
  const bool is_idle = !draining_ && queue_.size() == 0 && settings_.idle_max;
  if (is_idle && turn.now >= busy_at_ + *settings_.idle_max) {
    return drain(turn,
                 fmt::format("had nothing to do for {:.0f} s", to_seconds(turn.now - busy_at_)));
  }
  leave_if_drained(turn);
}

void WorkerCore::on(const Turn& turn, const DrainRequested&) {
  if (draining_) {
    turn.warn(kLeaving, "asked to stop twice: leaves at once");
    return exit(turn, 1);
  }
  drain(turn, "asked to stop");
}

void WorkerCore::drain(const Turn& turn, const std::string& why) {
  draining_ = true;
  finish_by_ = turn.now + settings_.drain_rollouts_max;
  definitions_.close();
  evaluators_.drain();
  for (const RolloutState state : {RolloutState::kWaiting, RolloutState::kReady}) {
    for (const RolloutName& name : queue_.in_state(state)) queue_.remove(name);
  }
  turn.inform(kLeaving,
              fmt::format("draining, {}: finishes {} running roll-outs", why, queue_.size()));
  send_status(turn);
}

void WorkerCore::leave_if_drained(const Turn& turn) {
  if (!draining_ || exited_) return;
  if (const std::size_t num_running = queue_.in_state(RolloutState::kRunning).size();
      num_running > 0) {
    if (finish_by_ && turn.now < *finish_by_) return;
    turn.warn(kLeaving, fmt::format("gives {} roll-outs up that did not end in {:.0f} s",
                                    num_running, to_seconds(settings_.drain_rollouts_max)));
    for (const RolloutName& name : queue_.in_state(RolloutState::kRunning)) drop(name);
  }
  finish_by_.reset();
  if (!drain_end_) drain_end_ = turn.now + settings_.drain_grace;
  const bool acknowledged = answers_.all_acknowledged();
  if (!acknowledged && turn.now < *drain_end_) return;
  if (!acknowledged) turn.warn(kLeaving, "leaves with answers no learner has acknowledged");
  turn.inform(kLeaving,
              fmt::format("evaluated {} roll-outs, was asked again for {}, restarted {} evaluators",
                          num_evaluated_, num_repeated_, evaluators_.num_restarts()));
  send_status(turn);
  exit(turn, 0);
}

void WorkerCore::exit(const Turn& turn, int status) {
  turn.log_rest();
  turn.effects.emplace_back(Exit{status});
  exited_ = true;
}

LearnerLink* WorkerCore::meet(const Turn& turn, protocol::LearnerId id) {
  if (const auto known = learners_.find(id); known != learners_.end()) return &known->second;
  if (learners_.size() >= settings_.num_learners_max) {
    auto victim = learners_.end();
    for (auto it = learners_.begin(); it != learners_.end(); ++it) {
      const bool idle = queue_.of_learner(it->first).empty();
      if (idle && (victim == learners_.end() || it->second.heard() < victim->second.heard())) {
        victim = it;
      }
    }
    if (victim == learners_.end()) {
      ++num_rejected_;
      return nullptr;
    }
    forget(turn, victim->first);
  }
  turn.inform("learners served", fmt::format("serves learner {}", id));
  num_workers_ = 0;  // it has not said how many it hears
  return &learners_.try_emplace(id, settings_, answers_.last_index(id), turn.now).first->second;
}

void WorkerCore::forget(const Turn& turn, protocol::LearnerId id) {
  const auto names = queue_.of_learner(id);
  if (!names.empty())
    turn.warn("roll-outs dropped", fmt::format("drops its {} roll-outs", names.size()));
  for (const RolloutName& name : names) drop(name);
  answers_.forget(id);
  last_batches_[id] = learners_.at(id).last_batch();
  if (last_batches_.size() > protocol::kForgottenLearnersMax) {
    last_batches_.erase(last_batches_.begin());
  }
  learners_.erase(id);
  count_workers(turn.now);
}

/// Played from a recording: what it asks has been dealt with.
bool WorkerCore::is_from_the_past(const protocol::RolloutBatch& batch) const {
  const auto last = last_batches_.find(batch.learner_id);
  return last != last_batches_.end() && batch.sequence <= last->second;
}

void WorkerCore::receive(const Turn& turn, protocol::RolloutBatch& batch) {
  const auto mine = [&](const auto& part) { return part.worker_id == settings_.worker_id; };
  const auto known = learners_.find(batch.learner_id);
  LearnerLink* learner = known == learners_.end() ? nullptr : &known->second;
  const bool is_for_me =
      std::any_of(batch.rollouts.begin(), batch.rollouts.end(), mine) ||
      std::any_of(batch.acknowledgements.begin(), batch.acknowledgements.end(), mine);
  if (learner == nullptr) {
    if (!is_for_me || is_from_the_past(batch)) return;
    learner = meet(turn, batch.learner_id);
    if (learner == nullptr) return;
    status_due_ = true;  // it leases nothing before it knows that it is heard
  }
  learner->hear_batch(turn.now, batch.sequence, is_for_me);
  for (const auto& acknowledgement : batch.acknowledgements) {
    if (!mine(acknowledgement)) continue;
    // An index that was never given settles nothing that waits to be sent.
    const std::int64_t settled = std::min(acknowledgement.result_index, learner->last_index_sent());
    const bool any_settled = answers_.acknowledge(batch.learner_id, settled);
    const bool any_left =
        answers_.first_index(batch.learner_id) <= answers_.last_index(batch.learner_id);
    const bool is_news =
        learner->on_acknowledged(turn.now, acknowledgement.seen_index, any_left, any_settled);
    if (!is_news) beat_within(turn, protocol::kBusyHeartbeat);  // a greeting, most likely
  }
  for (auto& request : batch.rollouts) {
    if (mine(request)) take_request(turn, batch.learner_id, batch.sequence, std::move(request));
  }
}

}  // namespace treeroll::worker
