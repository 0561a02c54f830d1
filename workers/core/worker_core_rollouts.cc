#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "workers/core/rollouts_together.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// Why these two cannot make this roll-out; empty if they can.
std::string mismatch(const DefinitionFacts& task, const DefinitionFacts& policy,
                     std::size_t theta_dim) {
  if (policy.theta_dim == 0) return {};  // who evaluates finds out
  if (task.input_dim != policy.input_dim || task.output_dim != policy.output_dim) {
    return fmt::format("the policy has {} inputs and {} outputs, the task takes {} and {}",
                       policy.input_dim, policy.output_dim, task.input_dim, task.output_dim);
  }
  if (static_cast<std::size_t>(policy.theta_dim) != theta_dim) {
    return fmt::format("the policy's layer takes a theta of {} numbers, the roll-out brings {}",
                       policy.theta_dim, theta_dim);
  }
  return {};
}

}  // namespace

void WorkerCore::take_request(const Turn& turn, protocol::LearnerId learner, std::int64_t sequence,
                              protocol::RolloutRequest request) {
  if (const auto index = answers_.repeat(learner, request.key, request.content, request.attempt)) {
    ++num_repeated_;
    LearnerLink& link = learners_.at(learner);
    return link.want_again(*index);
  }
  const RolloutName name{learner, request.key};
  if (HeldRollout* held = queue_.find(name)) {
    if (sequence < held->sequence) return;  // overtaken on the way
    held->sequence = sequence;
    if (held->request.content == request.content) {
      held->request.attempt = std::max(held->request.attempt, request.attempt);
      // Its learner does not know that it is held.
      return beat_within(turn, protocol::kBusyHeartbeat);
    }
    drop(name);
  }
  if (free_slots() <= 0) return;
  if (queue_.size() == 0) beat_within(turn, protocol::heartbeats_of(num_workers_).busy);
  const HeldRollout& held = queue_.add(name, std::move(request), sequence, turn.now);
  definitions_.touch({DefinitionKind::kTask, held.request.task_id});
  definitions_.touch({DefinitionKind::kPolicy, held.request.policy_id});
  review(name);
}

/// What is asked no more, also of an evaluator.
void WorkerCore::drop(const RolloutName& name) {
  queue_.remove(name);
  evaluators_.withdraw(name);
}

/// Moves a waiting roll-out on as far as its definitions allow: ready, or let go with a report.
void WorkerCore::review(const RolloutName& name) {
  const HeldRollout& held = *queue_.find(name);
  const protocol::RolloutRequest& request = held.request;
  const Definition* task = definitions_.find({DefinitionKind::kTask, request.task_id});
  const Definition* policy = definitions_.find({DefinitionKind::kPolicy, request.policy_id});
  if (task == nullptr || policy == nullptr || held.lacks_theta()) {
    learners_.at(name.learner).look_for_missing();
  }

  const auto let_go = [&](const ContentHash& id, const std::string& reason) {
    definitions_.report(name.learner, id, false, reason);
    queue_.remove(name);
  };
  if (task != nullptr && task->state == DefinitionState::kRefused) {
    return let_go(request.task_id, task->text);
  }
  if (policy != nullptr && policy->state == DefinitionState::kRefused) {
    return let_go(request.policy_id, policy->text);
  }
  if (task == nullptr || task->state != DefinitionState::kAccepted) return;
  if (policy == nullptr || policy->state != DefinitionState::kAccepted) return;
  if (held.lacks_theta()) return;
  const std::string reason = mismatch(task->facts, policy->facts, request.theta.size());
  if (!reason.empty()) return let_go(request.policy_id, reason);
  queue_.set_state(name, RolloutState::kReady);
}

void WorkerCore::assign_work(const Turn& turn) {
  while (const std::optional<int> idle = evaluators_.idle_evaluator()) {
    if (const auto definition = next_check(turn.now)) {
      evaluators_.check(turn, *idle, *definition, definitions_);
    } else if (const auto rollout = queue_.take()) {
      std::vector<RolloutName> names = {*rollout};
      const HeldRollout& first = *queue_.find(*rollout);
      const Definition& task = *definitions_.find({DefinitionKind::kTask, first.request.task_id});
      const std::size_t others = num_together(first, task, queue_.size(), settings_) - 1;
      for (const RolloutName& name :
           queue_.take_beside(*rollout, others, settings_.together_numbers_max)) {
        names.push_back(name);
      }
      std::vector<Work> works;
      for (const RolloutName& name : names) {
        const HeldRollout& held = *queue_.find(name);
        works.push_back({name, held.request, held.mishaps});
      }
      evaluators_.evaluate(turn, *idle, std::move(works), definitions_);
    } else {
      return;
    }
  }
}

/// Where every evaluator dies again and again the host is in trouble, not what it holds.
void WorkerCore::give_up_in_trouble(const Turn& turn) {
  if (!evaluators_.in_trouble()) return;
  turn.warn("roll-outs given up",
            fmt::format("gives {} roll-outs up: it has no evaluator that lasts", queue_.size()));
  std::vector<RolloutName> names;
  for (const auto& [name, held] : queue_.all()) names.push_back(name);
  for (const RolloutName& name : names) drop(name);  // one that was killed may not have ended yet
  status_due_ = true;
}

/// Nobody waits for it any more, and whoever else has work should have the evaluators. What runs
/// and is not repeatable ends by itself: its learner may come back and finds the answer.
void WorkerCore::give_up_work_of(const Turn& turn, protocol::LearnerId id) {
  const auto names = queue_.of_learner(id);
  if (names.empty()) return;
  std::size_t num_left = 0;
  for (const RolloutName& name : names) {
    if (evaluators_.end_work(turn, name)) {
      queue_.remove(name);
    } else {
      ++num_left;
    }
  }
  turn.warn("roll-outs dropped",
            fmt::format("learner {} has been silent for {:.0f} s: gives its {} roll-outs up{}", id,
                        to_seconds(settings_.learner_gone), names.size() - num_left,
                        num_left == 0 ? ""
                                      : fmt::format(", and lets {} end that is running and must "
                                                    "not run twice",
                                                    num_left)));
  status_due_ = true;
}

void WorkerCore::conclude(const Turn& turn, const WorkEnd& end) {
  if (const auto* given_up = std::get_if<WorkGivenUp>(&end)) {
    // It is no answer, so the learner has it evaluated elsewhere, or here again if there is nobody
    // else, as soon as a status does not name it any more.
    queue_.remove(given_up->name);
    status_due_ = true;
  } else if (const auto* put_back = std::get_if<WorkPutBack>(&end)) {
    const bool is_nobodys = learners_.at(put_back->name.learner).is_given_up();
    if (draining_ || is_nobodys) return queue_.remove(put_back->name);  // evaluated elsewhere
    queue_.find(put_back->name)->mishaps = put_back->mishaps;
    queue_.set_state(put_back->name, RolloutState::kReady);
  } else if (const auto* answer = std::get_if<WorkAnswered>(&end)) {
    ++num_evaluated_;
    const RolloutName& name = answer->name;
    const Outcome& outcome = answer->outcome;
    if (!outcome.is_ok() && !outcome.is_discarded()) {
      ++num_failed_;
      turn.warn("roll-outs answered as failed",
                fmt::format("answers roll-out {} of run {} as {}{}{}", name.key.number,
                            name.key.run, treeroll::name(outcome.status()),
                            outcome.reason().empty() ? "" : ": ", outcome.reason()));
    }
    const protocol::RolloutRequest& request = queue_.find(name)->request;
    answers_.add(name.learner, {.key = request.key,
                                .attempt = request.attempt,
                                .content = request.content,
                                .outcome = outcome,
                                .duration_ns = answer->duration_ns});
    learners_.at(name.learner).note_new_answer(turn.now);
    definitions_.on_evaluated({DefinitionKind::kTask, request.task_id},
                              std::chrono::nanoseconds(answer->duration_ns));
    queue_.remove(name);
  }
}

}  // namespace treeroll::worker
