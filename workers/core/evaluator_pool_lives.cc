#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "workers/core/evaluator_pool.h"

namespace treeroll::worker {
namespace {

constexpr Duration kLookAgainMin = std::chrono::milliseconds(1);
/// The first death without anything to blame may be an accident.
constexpr int kBareDeathsOfTrouble = 2;

// CPU time decides what a job may take, for on a loaded machine that is all an honest one cannot
// help. What sleeps or is stopped burns none: a job that has had less than 1 / kBusyShareInverse of
// one core over a stretch of wall time is blocked. A share this small is left to each of a hundred
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

void EvaluatorPool::start(const Turn& turn, int index) {
  Evaluator& evaluator = at(index);
  evaluator.state = State::kStarting;
  evaluator.since = turn.now;
  look_at(evaluator, turn.now + settings_.start_time_max);
  turn.effects.emplace_back(StartEvaluator{index});
}

void EvaluatorPool::kill(const Turn& turn, int index) {
  Evaluator& evaluator = at(index);
  evaluator.killed = true;
  evaluator.look_at.reset();
  idle_.erase(index);
  if (settings_.end_grace == Duration{}) {
    turn.effects.emplace_back(KillEvaluator{index});
  } else {
    turn.effects.emplace_back(EndEvaluator{index});
    look_at(evaluator, turn.now + settings_.end_grace);
  }
}

void EvaluatorPool::begin_job(const Turn& turn, Evaluator& evaluator, State state, Duration limit) {
  idle_.erase(index_of(evaluator));
  evaluator.state = state;
  evaluator.job = next_job_++;
  evaluator.since = turn.now;
  evaluator.busy_at = turn.now;
  evaluator.busy_cpu_time = {};
  evaluator.time_limit = std::max(limit, 2 * kLookAgainMin);
  look_at(evaluator, turn.now + look_interval(evaluator.time_limit));
}

void EvaluatorPool::watch(const Turn& turn) {
  if (turn.now < look_at_) return;
  look_at_ = TimePoint::max();
  for (int i = 0; i < settings_.num_evaluators; ++i) watch(turn, i);
  for (const Evaluator& evaluator : evaluators_) {
    if (evaluator.look_at) look_at_ = std::min(look_at_, *evaluator.look_at);
  }
}

/// Acts on an evaluator's own deadline.
void EvaluatorPool::watch(const Turn& turn, int index) {
  Evaluator& evaluator = at(index);
  if (!evaluator.look_at || turn.now < *evaluator.look_at) return;
  evaluator.look_at.reset();
  if (evaluator.killed) {
    turn.effects.emplace_back(KillEvaluator{index});
    return;
  }
  switch (evaluator.state) {
    case State::kDown:
      if (draining_) return;
      ++num_restarts_;
      start(turn, index);
      return;
    case State::kStarting:
      turn.warn("evaluators that do not start",
                fmt::format("evaluator {} did not start in {:.0f} s and is killed", index,
                            to_seconds(settings_.start_time_max)));
      kill(turn, index);
      return;
    case State::kLoading:
    case State::kRunning:
      look_at(evaluator, turn.now + look_interval(evaluator.time_limit));
      turn.effects.emplace_back(AskCpuTime{index, evaluator.job});
      return;
    case State::kIdle:
      return;
  }
}

void EvaluatorPool::look_at(Evaluator& evaluator, TimePoint time) {
  evaluator.look_at = time;
  look_at_ = std::min(look_at_, time);
}

void EvaluatorPool::excuse(Duration delay) {
  for (Evaluator& evaluator : evaluators_) {
    evaluator.busy_at += delay;
    if (evaluator.state == State::kStarting && evaluator.look_at) *evaluator.look_at += delay;
  }
}

EvaluatorPool::Ends EvaluatorPool::on(const Turn& turn, const CpuTimeMeasured& event,
                                      DefinitionShelf&) {
  Evaluator& evaluator = at(event.evaluator);
  const bool busy = evaluator.state == State::kLoading || evaluator.state == State::kRunning;
  if (!busy || evaluator.job != event.job || evaluator.killed) return {};
  const Duration limit = evaluator.time_limit;
  if (event.cpu_time - evaluator.busy_cpu_time >= blocked_after(limit) / kBusyShareInverse) {
    evaluator.busy_at = turn.now;
    evaluator.busy_cpu_time = event.cpu_time;
  }
  const TimePoint blocked_at = evaluator.busy_at + blocked_after(limit);
  if (event.cpu_time < limit && turn.now < blocked_at) {
    const Duration left = std::clamp(limit - event.cpu_time, kLookAgainMin,
                                     std::max(kLookAgainMin, look_interval(limit)));
    look_at(evaluator, std::min(turn.now + left, blocked_at));
    return {};
  }
  turn.warn("evaluators past a time limit",
            fmt::format("evaluator {} is {} (limit {:.3g} s, CPU {:.3g} s, wall {:.3g} s) and is "
                        "killed",
                        event.evaluator, event.cpu_time < limit ? "blocked" : "past its time limit",
                        to_seconds(limit), to_seconds(event.cpu_time),
                        to_seconds(turn.now - evaluator.since)));
  evaluator.timed_out = true;
  kill(turn, event.evaluator);
  return {};
}

EvaluatorPool::Ends EvaluatorPool::on(const Turn& turn, const EvaluatorDied& event,
                                      DefinitionShelf& definitions) {
  Evaluator& evaluator = at(event.evaluator);
  if (evaluator.state == State::kDown) return {};
  const bool busy = !evaluator.given.empty() || evaluator.loading;
  const bool charged =
      busy && (evaluator.timed_out || (!evaluator.killed && event.death != Death::kForeignSignal));
  if (!evaluator.dismissed) {
    turn.warn("evaluators that end",
              fmt::format("evaluator {} {}{}", event.evaluator, describe(event.death, event.code),
                          busy ? " during its work" : ""));
  }
  Ends ends;
  for (const Given& given : evaluator.given) {
    if (given.wanted && !given.done) {
      ends.push_back(interrupted(turn, event, given.work, charged));
    }
  }
  if (evaluator.loading && evaluator.given.empty()) {
    if (charged) definitions.on_strike(turn, *evaluator.loading, evaluator.timed_out);
    if (!charged) definitions.on_accident(*evaluator.loading);
  }
  const int num_bare_deaths = charged || evaluator.dismissed ? 0 : evaluator.num_bare_deaths + 1;
  evaluator = {};
  idle_.erase(event.evaluator);
  evaluator.num_bare_deaths = num_bare_deaths;
  if (draining_) return ends;
  // Who dies again and again is started ever more seldom.
  Duration delay{};
  if (num_bare_deaths >= kBareDeathsOfTrouble) {
    const int doublings = std::min(num_bare_deaths - kBareDeathsOfTrouble, 20);
    delay = std::min(settings_.restart_delay_min * (1 << doublings), settings_.restart_delay_max);
  }
  look_at(evaluator, turn.now + delay);
  watch(turn, event.evaluator);
  return ends;
}

/// What becomes of the work of an evaluator that has ended.
WorkEnd EvaluatorPool::interrupted(const Turn& turn, const EvaluatorDied& event, const Work& work,
                                   bool charged) const {
  const Evaluator& evaluator = evaluators_.at(static_cast<std::size_t>(event.evaluator));
  const RolloutName& name = work.name;
  Mishaps mishaps = work.mishaps;
  if (evaluator.given.size() > 1) {
    mishaps.alone = true;  // nobody knows whose fault it was
    return WorkPutBack{name, mishaps};
  }
  ++(charged ? mishaps.num_strikes : mishaps.num_accidents);
  if (charged) {
    turn.warn(
        "roll-outs that end evaluators",
        fmt::format("roll-out {} of run {} has ended {} of at most {} evaluators", name.key.number,
                    name.key.run, mishaps.num_strikes, settings_.num_strikes_max));
  }
  if (mishaps.num_strikes >= settings_.num_strikes_max) {
    const std::string reason =
        evaluator.timed_out ? fmt::format("took more than the task's {:g} s, {} times",
                                          to_seconds(evaluator.time_limit), mishaps.num_strikes)
                            : fmt::format("{} evaluators ended under it, and the last one {}",
                                          mishaps.num_strikes, describe(event.death, event.code));
    return WorkAnswered{
        .name = name,
        .outcome = Outcome::failed(
            evaluator.timed_out ? RolloutStatus::kTimedOut : RolloutStatus::kCrashed, reason),
        .duration_ns = (turn.now - evaluator.since).count()};
  }
  if (!draining_ && mishaps.num_accidents >= settings_.num_accidents_max) {
    turn.warn("roll-outs given up",
              fmt::format("gives roll-out {} of run {} up: {} evaluators were ended under it",
                          name.key.number, name.key.run, mishaps.num_accidents));
    return WorkGivenUp{name};
  }
  return WorkPutBack{name, mishaps};
}

bool EvaluatorPool::any_living() const {
  return std::any_of(evaluators_.begin(), evaluators_.end(), [](const Evaluator& evaluator) {
    return !evaluator.killed && evaluator.state != State::kDown &&
           evaluator.state != State::kStarting;
  });
}

bool EvaluatorPool::in_trouble() const {
  return !any_living() &&
         std::all_of(evaluators_.begin(), evaluators_.end(), [](const Evaluator& evaluator) {
           return evaluator.num_bare_deaths >= kBareDeathsOfTrouble;
         });
}

}  // namespace treeroll::worker
