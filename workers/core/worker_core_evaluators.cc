#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// Told to forget at most so many definitions before one piece of work, so that these small
/// messages always fit the socket beside it.
constexpr int kForgetsPerJobMax = 16;
constexpr Duration kLookAgainMin = std::chrono::milliseconds(1);
/// The first death without anything to blame may be an accident.
constexpr int kBareDeathsOfTrouble = 2;

// CPU time decides what a job may take, for on a loaded machine that is all an honest one cannot
// help. What sleeps or is stopped burns none: a job that has had less than kBusyShare of one core
// over a stretch of wall time is blocked. A share this small is left to each of a hundred
// evaluators that crowd one core. The stretch and the pause between two looks make twice the limit
// and a second from the moment it blocks, at most.
constexpr int kBusyShareInverse = 100;
Duration blocked_after(Duration cpu_limit) { return 3 * cpu_limit / 2 + std::chrono::seconds(1); }
Duration look_interval(Duration cpu_limit) { return cpu_limit / 2; }

std::string describe(Death death, int code) {
  return death == Death::kExited ? fmt::format("exited with status {}", code)
                                 : fmt::format("was ended by signal {}", code);
}

}  // namespace

void WorkerCore::on(const Turn&, const EvaluatorReady& event) {
  Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  if (evaluator.state != EvaluatorState::kStarting || evaluator.killed) return;
  const bool is_first = !any_living();
  release(evaluator);
  if (is_first) status_due_ = true;  // there is room again
}

void WorkerCore::on(const Turn& turn, const DefinitionLoaded& event) {
  Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  if (evaluator.state != EvaluatorState::kLoading || evaluator.loading != event.name) return;
  evaluator.loading.reset();
  evaluator.timed_out = false;
  if (event.accepted) evaluator.known.insert(event.name);

  DefinitionCache& definitions = cache(event.name.kind);
  Definition* definition = definitions.find(event.name.id);
  // Who loads it for a roll-out checks nothing, though it may have been evicted and come again
  // since. What is checked stays until its checker answers or dies.
  const bool checks = !evaluator.rollout;
  if (checks && definition != nullptr && definition->state == DefinitionState::kChecking) {
    if (event.accepted) {
      definition->state = DefinitionState::kAccepted;
      definition->text = event.text;
      definition->facts = event.facts;
    } else {
      definitions.refuse(*definition, event.text);
      turn.log(true, "definitions refused",
               fmt::format("refuses definition {}: {}", to_hex(event.name.id), event.text));
    }
    settle(turn, event.name, *definition);
  }
  if (rollout_of(evaluator) != nullptr && event.accepted && !evaluator.killed) {
    continue_rollout(turn, event.evaluator);
    return;
  }
  if (rollout_of(evaluator) != nullptr && !event.accepted) {
    turn.log(true, "definitions an evaluator cannot load",
             fmt::format("evaluator {} cannot load {}, which another one could: {}",
                         event.evaluator, to_hex(event.name.id), event.text));
    // An accident of this process, not the roll-out's: another one evaluates it.
    evaluator.killed = true;
    evaluator.look_at.reset();
    turn.effects.emplace_back(KillEvaluator{event.evaluator});
  }
  if (!evaluator.killed || rollout_of(evaluator) == nullptr) release(evaluator);
}

void WorkerCore::on(const Turn& turn, const RolloutEvaluated& event) {
  Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  if (evaluator.state != EvaluatorState::kRunning || evaluator.job != event.job) return;
  evaluator.num_bare_deaths = 0;
  evaluator.timed_out = false;
  if (rollout_of(evaluator) != nullptr) {
    // An evaluator runs a user's code: nothing but a finite reward of a success may pass.
    const bool valid = std::isfinite(event.reward) && event.reward >= 0;
    const RolloutStatus status =
        event.status == RolloutStatus::kOk && !valid ? RolloutStatus::kFailed : event.status;
    const double reward = status == RolloutStatus::kOk ? event.reward : 0;
    answer(turn, *evaluator.rollout, status, reward, std::max<std::int64_t>(event.duration_ns, 0));
  }
  release(evaluator);
}

void WorkerCore::on(const Turn& turn, const CpuTimeMeasured& event) {
  Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  const bool busy =
      evaluator.state == EvaluatorState::kLoading || evaluator.state == EvaluatorState::kRunning;
  if (!busy || evaluator.job != event.job || evaluator.killed) return;
  const Duration limit = evaluator.time_limit;
  if (event.cpu_time - evaluator.busy_cpu_time >= blocked_after(limit) / kBusyShareInverse) {
    evaluator.busy_at = turn.now;
    evaluator.busy_cpu_time = event.cpu_time;
  }
  const TimePoint blocked_at = evaluator.busy_at + blocked_after(limit);
  if (event.cpu_time < limit && turn.now < blocked_at) {
    const Duration left = std::clamp(limit - event.cpu_time, kLookAgainMin,
                                     std::max(kLookAgainMin, look_interval(limit)));
    evaluator.look_at = std::min(turn.now + left, blocked_at);
    return;
  }
  turn.log(true, "evaluators past a time limit",
           fmt::format("evaluator {} is {} (limit {:.3g} s, CPU {:.3g} s, wall {:.3g} s) and is "
                       "killed",
                       event.evaluator, event.cpu_time < limit ? "blocked" : "past its time limit",
                       to_seconds(limit), to_seconds(event.cpu_time),
                       to_seconds(turn.now - evaluator.since)));
  evaluator.killed = true;
  evaluator.timed_out = true;
  evaluator.look_at.reset();
  turn.effects.emplace_back(KillEvaluator{event.evaluator});
}

void WorkerCore::on(const Turn& turn, const EvaluatorDied& event) {
  Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  if (evaluator.state == EvaluatorState::kDown) return;
  const bool busy = evaluator.rollout || evaluator.loading;
  const bool charged =
      busy && (evaluator.timed_out || (!evaluator.killed && event.death != Death::kForeignSignal));
  turn.log(true, "evaluators that end",
           fmt::format("evaluator {} {}{}", event.evaluator, describe(event.death, event.code),
                       busy ? " during its work" : ""));
  if (evaluator.rollout) {
    strike_rollout(turn, evaluator, charged);
  } else if (evaluator.loading && charged) {
    strike_definition(turn, *evaluator.loading, evaluator.timed_out);
  } else if (evaluator.loading && !draining_) {
    cache(evaluator.loading->kind).find(evaluator.loading->id)->state = DefinitionState::kUnchecked;
    to_check_.push_front(*evaluator.loading);
  }
  const int num_bare_deaths = charged ? 0 : evaluator.num_bare_deaths + 1;
  evaluator = {};
  evaluator.num_bare_deaths = num_bare_deaths;
  if (draining_) return;
  give_all_up_in_trouble(turn);
  // Who dies again and again is started ever more seldom.
  Duration delay{};
  if (num_bare_deaths >= kBareDeathsOfTrouble) {
    const int doublings = std::min(num_bare_deaths - kBareDeathsOfTrouble, 20);
    delay = std::min(settings_.restart_delay_min * (1 << doublings), settings_.restart_delay_max);
  }
  evaluator.look_at = turn.now + delay;
  if (delay == Duration{}) watch_evaluator(turn, event.evaluator);
}

/// A deadline that was not served when due shows that this process was stopped or kept waiting, and
/// its evaluators most likely with it (Ctrl-Z, a frozen container). That time counts against none.
void WorkerCore::excuse_delay(TimePoint now) {
  const Duration delay = now - std::max(next_deadline(), last_step_);
  last_step_ = now;
  if (delay <= Duration{}) return;
  for (Evaluator& evaluator : evaluators_) {
    evaluator.busy_at += delay;
    if (evaluator.state == EvaluatorState::kStarting && evaluator.look_at) {
      *evaluator.look_at += delay;
    }
  }
}

/// Acts on an evaluator's own deadline.
void WorkerCore::watch_evaluator(const Turn& turn, int index) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(index)];
  if (!evaluator.look_at || turn.now < *evaluator.look_at) return;
  evaluator.look_at.reset();
  switch (evaluator.state) {
    case EvaluatorState::kDown:
      if (draining_) return;
      ++num_restarts_;
      evaluator.state = EvaluatorState::kStarting;
      evaluator.since = turn.now;
      evaluator.look_at = turn.now + settings_.start_time_max;
      turn.effects.emplace_back(StartEvaluator{index});
      return;
    case EvaluatorState::kStarting:
      turn.log(true, "evaluators that do not start",
               fmt::format("evaluator {} did not start in {:.0f} s and is killed", index,
                           to_seconds(settings_.start_time_max)));
      evaluator.killed = true;
      turn.effects.emplace_back(KillEvaluator{index});
      return;
    case EvaluatorState::kLoading:
    case EvaluatorState::kRunning:
      evaluator.look_at = turn.now + look_interval(evaluator.time_limit);
      turn.effects.emplace_back(AskCpuTime{index, evaluator.job});
      return;
    case EvaluatorState::kIdle:
      return;
  }
}

void WorkerCore::assign_work(const Turn& turn) {
  for (int i = 0; i < settings_.num_evaluators; ++i) {
    Evaluator& evaluator = evaluators_[static_cast<std::size_t>(i)];
    // More than once only where a definition to check has been evicted meanwhile.
    while (evaluator.state == EvaluatorState::kIdle && !evaluator.killed) {
      if (!to_check_.empty()) {
        const DefinitionName name = to_check_.front();
        to_check_.pop_front();
        Definition* definition = cache(name.kind).find(name.id);
        if (definition == nullptr || definition->state != DefinitionState::kUnchecked) continue;
        definition->state = DefinitionState::kChecking;
        load(turn, i, name);
        continue;
      }
      const std::optional<RolloutName> next = queue_.take();
      if (!next) return;
      evaluator.rollout = next;
      evaluator.content = queue_.find(*next)->request.content;
      continue_rollout(turn, i);
    }
  }
}

/// Gives the evaluator what its roll-out still needs, at last the roll-out itself.
void WorkerCore::continue_rollout(const Turn& turn, int index) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(index)];
  const protocol::RolloutRequest& request = rollout_of(evaluator)->request;
  for (const DefinitionName& name : {DefinitionName{DefinitionKind::kTask, request.task_id},
                                     DefinitionName{DefinitionKind::kPolicy, request.policy_id}}) {
    cache(name.kind).touch(name.id);
    if (!evaluator.known.contains(name)) {
      load(turn, index, name);
      return;
    }
  }
  const Duration limit = tasks_.find(request.task_id)->facts.time_limit;
  begin_job(turn, evaluator, EvaluatorState::kRunning, limit);
  turn.effects.emplace_back(RunRollout{index, evaluator.job, request});
}

void WorkerCore::load(const Turn& turn, int index, const DefinitionName& name) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(index)];
  const std::int64_t num_evicted = tasks_.num_evicted() + policies_.num_evicted();
  if (evaluator.num_evicted_seen != num_evicted) {
    int num_forgotten = 0;
    for (auto it = evaluator.known.begin(); it != evaluator.known.end();) {
      const bool kept = cache(it->kind).find(it->id) != nullptr;
      if (!kept && num_forgotten == kForgetsPerJobMax) break;
      if (!kept) turn.effects.emplace_back(ForgetDefinition{index, *it});
      num_forgotten += kept ? 0 : 1;
      it = kept ? std::next(it) : evaluator.known.erase(it);
    }
    if (num_forgotten < kForgetsPerJobMax) evaluator.num_evicted_seen = num_evicted;
  }
  begin_job(turn, evaluator, EvaluatorState::kLoading, settings_.load_time_limit);
  evaluator.loading = name;
  turn.effects.emplace_back(
      LoadDefinition{index, evaluator.job, name, cache(name.kind).find(name.id)->content});
}

void WorkerCore::begin_job(const Turn& turn, Evaluator& evaluator, EvaluatorState state,
                           Duration limit) {
  evaluator.state = state;
  evaluator.job = next_job_++;
  evaluator.since = turn.now;
  evaluator.busy_at = turn.now;
  evaluator.busy_cpu_time = {};
  evaluator.time_limit = std::max(limit, 2 * kLookAgainMin);
  evaluator.look_at = turn.now + look_interval(evaluator.time_limit);
}

void WorkerCore::release(Evaluator& evaluator) {
  evaluator.state = EvaluatorState::kIdle;
  evaluator.rollout.reset();
  evaluator.loading.reset();
  evaluator.look_at.reset();
}

/// The roll-out the evaluator has, unless it was taken from it: forgotten or asked anew.
HeldRollout* WorkerCore::rollout_of(const Evaluator& evaluator) {
  if (!evaluator.rollout) return nullptr;
  HeldRollout* held = queue_.find(*evaluator.rollout);
  const bool same = held != nullptr && held->state == RolloutState::kRunning &&
                    held->request.content == evaluator.content;
  return same ? held : nullptr;
}

void WorkerCore::strike_rollout(const Turn& turn, const Evaluator& evaluator, bool charged) {
  HeldRollout* held = rollout_of(evaluator);
  if (held == nullptr) return;
  const RolloutName name = *evaluator.rollout;
  if (charged) {
    ++held->num_strikes;
    turn.log(
        true, "roll-outs that end evaluators",
        fmt::format("roll-out {} of run {} has ended {} of at most {} evaluators", name.key.number,
                    name.key.run, held->num_strikes, settings_.num_strikes_max));
  } else {
    ++held->num_accidents;
  }
  if (held->num_strikes >= settings_.num_strikes_max) {
    answer(turn, name, evaluator.timed_out ? RolloutStatus::kTimedOut : RolloutStatus::kCrashed, 0,
           (turn.now - evaluator.since).count());
  } else if (draining_) {
    queue_.remove(name);  // the learner has it evaluated elsewhere
  } else if (held->num_accidents >= settings_.num_accidents_max) {
    turn.log(true, "roll-outs given up",
             fmt::format("gives roll-out {} of run {} up: {} evaluators were ended under it",
                         name.key.number, name.key.run, held->num_accidents));
    give_up(name);
  } else {
    queue_.set_state(name, RolloutState::kReady);
  }
}

/// It is no answer, so the learner has it evaluated elsewhere, or here again if there is nobody
/// else, as soon as a status does not name it any more.
void WorkerCore::give_up(const RolloutName& name) {
  queue_.remove(name);
  status_due_ = true;
}

/// Where every evaluator dies again and again the host is in trouble, not what it holds.
void WorkerCore::give_all_up_in_trouble(const Turn& turn) {
  if (queue_.size() == 0 || any_living()) return;
  const bool in_trouble = std::all_of(
      evaluators_.begin(), evaluators_.end(),
      [](const Evaluator& evaluator) { return evaluator.num_bare_deaths >= kBareDeathsOfTrouble; });
  if (!in_trouble) return;
  turn.log(
      true, "roll-outs given up",
      fmt::format("gives {} roll-outs up: all its evaluators die again and again", queue_.size()));
  std::vector<RolloutName> names;
  for (const auto& [name, held] : queue_.all()) names.push_back(name);
  for (const RolloutName& name : names) give_up(name);
}

void WorkerCore::strike_definition(const Turn& turn, const DefinitionName& name, bool timed_out) {
  DefinitionCache& definitions = cache(name.kind);
  Definition& definition = *definitions.find(name.id);
  if (++definition.num_strikes < settings_.num_strikes_max) {
    definition.state = DefinitionState::kUnchecked;
    if (!draining_) to_check_.push_front(name);
    return;
  }
  definitions.refuse(
      definition, fmt::format("loading it {} {} evaluators",
                              timed_out ? "took too long for" : "crashed", definition.num_strikes));
  turn.log(true, "definitions refused",
           fmt::format("refuses definition {}: {}", to_hex(name.id), definition.text));
  settle(turn, name, definition);
}

void WorkerCore::answer(const Turn& turn, const RolloutName& name, RolloutStatus status,
                        double reward, std::int64_t duration_ns) {
  const protocol::RolloutRequest& request = queue_.find(name)->request;
  const bool failed = status != RolloutStatus::kOk;
  ++num_evaluated_;
  num_failed_ += failed ? 1 : 0;
  if (status == RolloutStatus::kCrashed || status == RolloutStatus::kTimedOut) {
    turn.log(true, "roll-outs answered as failed",
             fmt::format("answers roll-out {} of run {} as {}", name.key.number, name.key.run,
                         treeroll::name(status)));
  }
  answers_.add(name.learner, {.key = request.key,
                              .attempt = request.attempt,
                              .content = request.content,
                              .reward = reward,
                              .status = status,
                              .duration_ns = duration_ns});
  queue_.remove(name);
}

bool WorkerCore::any_living() const {
  return std::any_of(evaluators_.begin(), evaluators_.end(), [](const Evaluator& evaluator) {
    return !evaluator.killed && evaluator.state != EvaluatorState::kDown &&
           evaluator.state != EvaluatorState::kStarting;
  });
}

bool WorkerCore::any_running() const {
  return std::any_of(queue_.all().begin(), queue_.all().end(), [](const auto& entry) {
    return entry.second.state == RolloutState::kRunning;
  });
}

}  // namespace treeroll::worker
