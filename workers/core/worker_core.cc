#include "workers/core/worker_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

constexpr const char* kLeaving = "leaving";

const char* word(DefinitionKind kind) { return kind == DefinitionKind::kTask ? "task" : "policy"; }

/// Why these two cannot make this roll-out; empty if they can.
std::string mismatch(const DefinitionFacts& task, const DefinitionFacts& policy,
                     std::size_t theta_dim) {
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

WorkerCore::WorkerCore(WorkerSettings settings)
    : settings_(std::move(settings)),
      answers_(settings_.num_answers_max),
      tasks_(settings_.num_tasks_max, settings_.definition_bytes_max),
      policies_(settings_.num_policies_max, settings_.definition_bytes_max),
      evaluators_(static_cast<std::size_t>(settings_.num_evaluators)) {
  CHECK(settings_.num_evaluators > 0, "a worker without evaluators");
  CHECK(settings_.batch_bytes_max >= protocol::kBatchBytesRemoteMax, "batches too small");
}

namespace {

void write(std::vector<LogLine>& lines, Effects& effects) {
  for (LogLine& line : lines) {
    effects.emplace_back(WriteLog{line.level != LogLine::Level::kInfo, std::move(line.text)});
  }
}

}  // namespace

void WorkerCore::Turn::log(bool warning, std::string_view kind, std::string text) const {
  const auto level = warning ? LogLine::Level::kWarning : LogLine::Level::kInfo;
  std::vector<LogLine> passed;
  limiter.add(now, {level, kind, std::move(text)}, passed);
  write(passed, effects);
}

void WorkerCore::step(TimePoint now, const Event& event, Effects& effects) {
  if (exited_) return;
  excuse_delay(now);
  const Turn turn{now, effects, log_limiter_};
  std::visit([&](const auto& e) { on(turn, e); }, event);
  if (!exited_) assign_work(turn);
}

TimePoint WorkerCore::next_deadline() const {
  if (exited_) return TimePoint::max();
  TimePoint deadline = heartbeat_at_;
  const auto include = [&](const std::optional<TimePoint>& time) {
    if (time) deadline = std::min(deadline, *time);
  };
  for (const auto& [id, learner] : learners_) {
    include(learner.heard + settings_.learner_silence_max);
    include(learner.repeat_at);
    include(learner.ask_at);
  }
  for (const Evaluator& evaluator : evaluators_) include(evaluator.look_at);
  include(drain_end_);
  return deadline;
}

void WorkerCore::on(const Turn& turn, const Started&) {
  for (std::size_t i = 0; i < evaluators_.size(); ++i) {
    evaluators_[i].state = EvaluatorState::kStarting;
    evaluators_[i].since = turn.now;
    evaluators_[i].look_at = turn.now + settings_.start_time_max;
    turn.effects.emplace_back(StartEvaluator{static_cast<int>(i)});
  }
  send_status(turn);
}

void WorkerCore::on(const Turn& turn, const MessageReceived& event) {
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&event.message)) {
    receive(turn, *batch);
  } else if (const auto* task = std::get_if<protocol::TaskDefinition>(&event.message)) {
    receive_definition(turn, task->learner_id, {DefinitionKind::kTask, task->task_id},
                       task->content);
  } else if (const auto* policy = std::get_if<protocol::PolicyDefinition>(&event.message)) {
    receive_definition(turn, policy->learner_id, {DefinitionKind::kPolicy, policy->policy_id},
                       policy->content);
  } else if (const auto* status = std::get_if<protocol::LearnerStatus>(&event.message)) {
    const auto known = learners_.find(status->learner_id);
    if (known != learners_.end()) known->second.heard = turn.now;
  }
}

void WorkerCore::on(const Turn& turn, const InboxDrained&) {
  send_reports(turn);
  for (auto& [id, learner] : learners_) {
    if (learner.asking) ask_for_definitions(turn, id, learner);
    const std::int64_t last_sent = learner.last_sent_index;
    const std::int64_t window_end =
        std::min(answers_.last_index(id),
                 answers_.first_index(id) - 1 +
                     static_cast<std::int64_t>(num_results_max(queue_.keys(id).size())));
    if (learner.answers_due || window_end > last_sent) send_answers(turn, id, learner);
    hurry_if_full(turn, id, learner);
  }
  if (status_due_) send_status(turn);
  finish_if_drained(turn);
}

void WorkerCore::on(const Turn& turn, const TimerFired&) {
  std::vector<protocol::LearnerId> silent;
  for (auto& [id, learner] : learners_) {
    if (turn.now >= learner.heard + settings_.learner_silence_max) {
      silent.push_back(id);
      continue;
    }
    if (learner.ask_at && turn.now >= *learner.ask_at) {
      learner.asking = true;
      ask_for_definitions(turn, id, learner);
    }
    if (learner.repeat_at && turn.now >= *learner.repeat_at) {
      back_off(id, learner);
      send_answers(turn, id, learner);
    }
  }
  for (const protocol::LearnerId id : silent) {
    turn.log(false, "learners forgotten",
             fmt::format("learner {:x} has been silent for {:.0f} s and is forgotten", id,
                         to_seconds(settings_.learner_silence_max)));
    forget(turn, id);
  }
  for (int i = 0; i < settings_.num_evaluators; ++i) watch_evaluator(turn, i);
  if (turn.now >= heartbeat_at_) {
    std::vector<LogLine> due;
    log_limiter_.tell_due(turn.now, due);
    write(due, turn.effects);
    send_status(turn);
  }
  finish_if_drained(turn);
}

void WorkerCore::on(const Turn& turn, const DrainRequested&) {
  if (draining_) {
    turn.log(true, kLeaving, "asked to stop twice: leaves at once");
    return exit(turn, 1);
  }
  draining_ = true;
  to_check_.clear();
  for (const RolloutState state : {RolloutState::kWaiting, RolloutState::kReady}) {
    for (const RolloutName& name : queue_.in_state(state)) queue_.remove(name);
  }
  turn.log(false, kLeaving, fmt::format("draining: finishes {} running roll-outs", queue_.size()));
  send_status(turn);
}

void WorkerCore::finish_if_drained(const Turn& turn) {
  if (!draining_ || exited_ || any_running()) return;
  if (!drain_end_) drain_end_ = turn.now + settings_.drain_grace;
  const bool acknowledged = answers_.all_acknowledged();
  if (!acknowledged && turn.now < *drain_end_) return;
  if (!acknowledged) turn.log(true, kLeaving, "leaves with answers no learner has acknowledged");
  turn.log(false, kLeaving,
           fmt::format("evaluated {} roll-outs, was asked again for {}, restarted {} evaluators",
                       num_evaluated_, num_repeated_, num_restarts_));
  send_status(turn);
  exit(turn, 0);
}

void WorkerCore::exit(const Turn& turn, int status) {
  std::vector<LogLine> rest;
  log_limiter_.tell_rest(turn.now, rest);
  write(rest, turn.effects);
  turn.effects.emplace_back(Exit{status});
  exited_ = true;
}

WorkerCore::Learner* WorkerCore::meet(const Turn& turn, protocol::LearnerId id) {
  if (const auto known = learners_.find(id); known != learners_.end()) return &known->second;
  if (learners_.size() >= settings_.num_learners_max) {
    auto victim = learners_.end();
    for (auto it = learners_.begin(); it != learners_.end(); ++it) {
      const bool idle = queue_.of_learner(it->first).empty();
      if (idle && (victim == learners_.end() || it->second.heard < victim->second.heard)) {
        victim = it;
      }
    }
    if (victim == learners_.end()) {
      ++num_rejected_;
      return nullptr;
    }
    forget(turn, victim->first);
  }
  turn.log(false, "learners served", fmt::format("serves learner {:x}", id));
  Learner& learner = learners_[id];
  learner.last_sent_index = answers_.last_index(id);
  return &learner;
}

void WorkerCore::forget(const Turn& turn, protocol::LearnerId id) {
  const auto names = queue_.of_learner(id);
  if (!names.empty())
    turn.log(true, "roll-outs dropped", fmt::format("drops its {} roll-outs", names.size()));
  for (const RolloutName& name : names) queue_.remove(name);
  answers_.forget(id);
  learners_.erase(id);
}

void WorkerCore::receive(const Turn& turn, const protocol::RolloutBatch& batch) {
  const auto mine = [&](const auto& part) { return part.worker_id == settings_.worker_id; };
  const auto known = learners_.find(batch.learner_id);
  Learner* learner = known == learners_.end() ? nullptr : &known->second;
  if (learner == nullptr) {
    if (std::none_of(batch.rollouts.begin(), batch.rollouts.end(), mine)) return;
    learner = meet(turn, batch.learner_id);
    if (learner == nullptr) return;
  }
  learner->heard = turn.now;
  learner->last_batch = std::max(learner->last_batch, batch.sequence);
  for (const auto& acknowledgement : batch.acknowledgements) {
    if (!mine(acknowledgement)) continue;
    if (!answers_.acknowledge(batch.learner_id, acknowledgement.result_index)) continue;
    learner->repeat_interval = settings_.repeat_interval_min;
    learner->num_hasty = 0;
    learner->repeat_at.reset();
    if (answers_.first_index(batch.learner_id) <= answers_.last_index(batch.learner_id)) {
      learner->repeat_at = turn.now + learner->repeat_interval;
    }
  }
  for (const auto& request : batch.rollouts) {
    if (mine(request)) take_request(turn, batch.learner_id, *learner, batch.sequence, request);
  }
}

void WorkerCore::take_request(const Turn& turn, protocol::LearnerId learner_id, Learner& learner,
                              std::int64_t sequence, const protocol::RolloutRequest& request) {
  if (answers_.repeat(learner_id, request.key, request.content, request.attempt)) {
    ++num_repeated_;
    learner.answers_due = true;
    return;
  }
  const RolloutName name{learner_id, request.key};
  if (HeldRollout* held = queue_.find(name)) {
    if (sequence < held->sequence) return;  // overtaken on the way
    held->sequence = sequence;
    if (held->request.content == request.content) {
      held->request.attempt = std::max(held->request.attempt, request.attempt);
      return;
    }
    queue_.remove(name);
  }
  if (free_slots() <= 0) return;
  if (queue_.size() == 0) {
    heartbeat_at_ = std::min(heartbeat_at_, turn.now + settings_.busy_heartbeat);
  }
  queue_.add(name, request, sequence, turn.now);
  if (tasks_.find(request.task_id) != nullptr) tasks_.touch(request.task_id);
  if (policies_.find(request.policy_id) != nullptr) policies_.touch(request.policy_id);
  review(turn, name);
}

void WorkerCore::receive_definition(const Turn& turn, protocol::LearnerId learner,
                                    const DefinitionName& name, const std::string& content) {
  if (draining_) return;
  if (content_hash(content) != name.id) {
    ++num_rejected_;
    turn.log(true, "definitions refused",
             fmt::format("a {} definition of learner {:x} is not what its id {} names",
                         word(name.kind), learner, to_hex(name.id)));
    return;
  }
  DefinitionCache& definitions = cache(name.kind);
  Definition* definition = definitions.find(name.id);
  if (definition == nullptr) {
    definition = definitions.insert(name.id, content, in_use(name.kind));
    if (definition == nullptr) return;  // all in use: asked for again while it is waited for
    to_check_.push_back(name);
    forget_stale_checks();
  } else {
    definitions.touch(name.id);
  }
  if (definition->to_tell.size() < settings_.num_learners_max) definition->to_tell.insert(learner);
  const bool settled = definition->state == DefinitionState::kAccepted ||
                       definition->state == DefinitionState::kRefused;
  if (settled) settle(turn, name, *definition);
}

/// What was evicted unchecked stays named in the row of what is to be checked. While no evaluator
/// is idle, a flood of definitions would make it grow.
void WorkerCore::forget_stale_checks() {
  if (to_check_.size() <= 2 * (settings_.num_tasks_max + settings_.num_policies_max)) return;
  std::set<DefinitionName> seen;
  std::erase_if(to_check_, [&](const DefinitionName& name) {
    const Definition* definition = cache(name.kind).find(name.id);
    const bool waits = definition != nullptr && definition->state == DefinitionState::kUnchecked;
    return !waits || !seen.insert(name).second;
  });
}

void WorkerCore::settle(const Turn& turn, const DefinitionName& name, Definition& definition) {
  const bool accepted = definition.state == DefinitionState::kAccepted;
  for (const protocol::LearnerId learner : definition.to_tell) {
    report(learner, name.id, accepted, definition.text);
  }
  definition.to_tell.clear();
  review_waiting(turn);
}

void WorkerCore::report(protocol::LearnerId learner, const ContentHash& id, bool accepted,
                        const std::string& text) {
  const auto earlier = reports_.find({learner, id});
  if (earlier != reports_.end() && !earlier->second.accepted) return;
  // Who is not told now asks again.
  if (earlier == reports_.end() && reports_.size() >= protocol::kReportsPerTurnMax) return;
  reports_[{learner, id}] = {.worker_id = settings_.worker_id,
                             .learner_id = learner,
                             .definition_id = id,
                             .accepted = accepted,
                             .text = text};
}

void WorkerCore::review_waiting(const Turn& turn) {
  for (const RolloutName& name : queue_.in_state(RolloutState::kWaiting)) review(turn, name);
}

/// Moves a waiting roll-out on as far as its definitions allow: ready, or let go with a report.
void WorkerCore::review(const Turn&, const RolloutName& name) {
  const protocol::RolloutRequest& request = queue_.find(name)->request;
  const Definition* task = tasks_.find(request.task_id);
  const Definition* policy = policies_.find(request.policy_id);
  if (task == nullptr || policy == nullptr) learners_.at(name.learner).asking = true;

  const auto let_go = [&](const ContentHash& id, const std::string& reason) {
    report(name.learner, id, false, reason);
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
  const std::string reason = mismatch(task->facts, policy->facts, request.theta.size());
  if (!reason.empty()) return let_go(request.policy_id, reason);
  queue_.set_state(name, RolloutState::kReady);
}

DefinitionCache& WorkerCore::cache(DefinitionKind kind) {
  return kind == DefinitionKind::kTask ? tasks_ : policies_;
}

std::set<ContentHash> WorkerCore::in_use(DefinitionKind kind) const {
  std::set<ContentHash> ids;
  for (const auto& [name, held] : queue_.all()) {
    ids.insert(kind == DefinitionKind::kTask ? held.request.task_id : held.request.policy_id);
  }
  return ids;
}

}  // namespace treeroll::worker
