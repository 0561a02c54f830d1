#include "workers/core/evaluator_pool.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

/// Told to forget at most so many definitions before one piece of work, so that these small
/// messages always fit the socket beside it.
constexpr int kForgetsPerJobMax = 16;
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

EvaluatorPool::EvaluatorPool(const WorkerSettings& settings)
    : settings_(settings), evaluators_(static_cast<std::size_t>(settings.num_evaluators)) {
  CHECK(settings.num_evaluators > 0, "a worker without evaluators");
}

void EvaluatorPool::start(const Turn& turn) {
  for (int i = 0; i < settings_.num_evaluators; ++i) start(turn, i);
}

std::optional<int> EvaluatorPool::idle_evaluator() const {
  return idle_.empty() ? std::nullopt : std::optional(*idle_.begin());
}

void EvaluatorPool::check(const Turn& turn, int index, const DefinitionName& name,
                          const DefinitionShelf& definitions) {
  load(turn, index, name, definitions);
}

void EvaluatorPool::evaluate(const Turn& turn, int index, std::vector<Work> works,
                             DefinitionShelf& definitions) {
  CHECK(!works.empty(), "an evaluator is given no work");
  for (Work& work : works) at(index).given.push_back({std::move(work)});
  continue_work(turn, index, definitions);
}

void EvaluatorPool::withdraw(const RolloutName& name) {
  for (Evaluator& evaluator : evaluators_) {
    for (Given& given : evaluator.given) {
      if (given.work.name == name) given.wanted = false;
    }
  }
}

void EvaluatorPool::end_work(const Turn& turn, const RolloutName& name) {
  withdraw(name);
  for (int i = 0; i < settings_.num_evaluators; ++i) {
    Evaluator& evaluator = at(i);
    const bool has_it =
        std::ranges::any_of(evaluator.given, [&](const Given& g) { return g.work.name == name; });
    if (!has_it || evaluator.killed) continue;
    evaluator.dismissed = true;
    kill(turn, i);
  }
}

std::vector<WorkEnd> EvaluatorPool::on(const Turn& turn, const EvaluatorEvent& event,
                                       DefinitionShelf& definitions) {
  return std::visit([&](const auto& e) { return on(turn, e, definitions); }, event);
}

EvaluatorPool::Ends EvaluatorPool::on(const Turn&, const EvaluatorReady& event, DefinitionShelf&) {
  Evaluator& evaluator = at(event.evaluator);
  if (evaluator.state == State::kStarting && !evaluator.killed) release(evaluator);
  return {};
}

EvaluatorPool::Ends EvaluatorPool::on(const Turn& turn, const DefinitionLoaded& event,
                                      DefinitionShelf& definitions) {
  Evaluator& evaluator = at(event.evaluator);
  if (evaluator.state != State::kLoading || evaluator.loading != event.name) return {};
  evaluator.loading.reset();
  evaluator.timed_out = false;
  if (event.accepted) evaluator.known.insert(event.name);
  // Who loads it for a roll-out checks nothing, though it may have been evicted and come again
  // since. What is checked stays until its checker answers or dies.
  if (evaluator.given.empty()) definitions.on_checked(turn, event);

  const bool wanted = evaluator.is_wanted();
  if (wanted && event.accepted && !evaluator.killed) {
    continue_work(turn, event.evaluator, definitions);
    return {};
  }
  if (wanted && !event.accepted) {
    turn.warn("definitions an evaluator cannot load",
              fmt::format("evaluator {} cannot load {}, which another one could: {}",
                          event.evaluator, to_hex(event.name.id), event.text));
    // An accident of this process, not the roll-out's: another one evaluates it.
    kill(turn, event.evaluator);
  }
  if (!evaluator.killed || !wanted) release(evaluator);
  return {};
}

EvaluatorPool::Ends EvaluatorPool::on(const Turn&, const RolloutEvaluated& event,
                                      DefinitionShelf&) {
  Evaluator& evaluator = at(event.evaluator);
  const std::int64_t place = event.job - evaluator.job;
  if (evaluator.state != State::kRunning || place < 0 || place >= std::ssize(evaluator.given)) {
    return {};
  }
  Given& given = evaluator.given[static_cast<std::size_t>(place)];
  if (given.done) return {};
  given.done = true;
  ++evaluator.num_done;
  evaluator.num_bare_deaths = 0;
  Ends ends;
  if (given.wanted) {
    // An evaluator runs a user's code: nothing but a finite reward of a success may pass.
    const Outcome& said = event.outcome;
    const bool valid = std::isfinite(said.reward()) && said.reward() >= 0;
    ends.push_back(
        WorkAnswered{.name = given.work.name,
                     .outcome = valid ? said
                                      : Outcome::failed(RolloutStatus::kFailed,
                                                        "its reward is no finite number from 0 on"),
                     .duration_ns = std::max<std::int64_t>(event.duration_ns, 0)});
  }
  if (evaluator.num_done == std::ssize(evaluator.given)) {
    evaluator.timed_out = false;
    release(evaluator);
  }
  return ends;
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
      ends.push_back(interrupted(turn, evaluator, given.work, charged));
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
WorkEnd EvaluatorPool::interrupted(const Turn& turn, const Evaluator& evaluator, const Work& work,
                                   bool charged) const {
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
        evaluator.timed_out
            ? fmt::format("took more than the task's {:g} s, {} times",
                          to_seconds(evaluator.time_limit), mishaps.num_strikes)
            : fmt::format("ended {} evaluators by a fatal signal", mishaps.num_strikes);
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

void EvaluatorPool::watch(const Turn& turn) {
  if (turn.now < look_at_) return;
  look_at_ = TimePoint::max();
  for (int i = 0; i < settings_.num_evaluators; ++i) watch(turn, i);
  for (const Evaluator& evaluator : evaluators_) {
    if (evaluator.look_at) look_at_ = std::min(look_at_, *evaluator.look_at);
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

void EvaluatorPool::start(const Turn& turn, int index) {
  Evaluator& evaluator = at(index);
  evaluator.state = State::kStarting;
  evaluator.since = turn.now;
  look_at(evaluator, turn.now + settings_.start_time_max);
  turn.effects.emplace_back(StartEvaluator{index});
}

void EvaluatorPool::kill(const Turn& turn, int index) {
  at(index).killed = true;
  at(index).look_at.reset();
  idle_.erase(index);
  turn.effects.emplace_back(KillEvaluator{index});
}

/// Acts on an evaluator's own deadline.
void EvaluatorPool::watch(const Turn& turn, int index) {
  Evaluator& evaluator = at(index);
  if (!evaluator.look_at || turn.now < *evaluator.look_at) return;
  evaluator.look_at.reset();
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

/// Gives the evaluator what its work still needs, at last the roll-outs that are still wanted.
/// Precondition: one is.
void EvaluatorPool::continue_work(const Turn& turn, int index, DefinitionShelf& definitions) {
  Evaluator& evaluator = at(index);
  const protocol::RolloutRequest& request = evaluator.given.front().work.request;
  const DefinitionName task{DefinitionKind::kTask, request.task_id};
  for (const DefinitionName& name : {task, {DefinitionKind::kPolicy, request.policy_id}}) {
    definitions.touch(name);
    if (!evaluator.known.contains(name)) return load(turn, index, name, definitions);
  }
  std::erase_if(evaluator.given, [](const Given& given) { return !given.wanted; });
  const std::int64_t count = std::ssize(evaluator.given);
  begin_job(turn, evaluator, State::kRunning, count * definitions.find(task)->facts.time_limit);
  next_job_ = evaluator.job + count;
  RunRollouts run{.evaluator = index, .job = evaluator.job, .requests = {}};
  run.requests.reserve(evaluator.given.size());
  for (Given& given : evaluator.given) run.requests.push_back(std::move(given.work.request));
  turn.effects.emplace_back(std::move(run));
}

void EvaluatorPool::load(const Turn& turn, int index, const DefinitionName& name,
                         const DefinitionShelf& definitions) {
  Evaluator& evaluator = at(index);
  if (evaluator.num_evicted_seen != definitions.num_evicted()) {
    int num_forgotten = 0;
    for (auto it = evaluator.known.begin(); it != evaluator.known.end();) {
      const bool kept = definitions.find(*it) != nullptr;
      if (!kept && num_forgotten == kForgetsPerJobMax) break;
      if (!kept) turn.effects.emplace_back(ForgetDefinition{index, *it});
      num_forgotten += kept ? 0 : 1;
      it = kept ? std::next(it) : evaluator.known.erase(it);
    }
    if (num_forgotten < kForgetsPerJobMax) evaluator.num_evicted_seen = definitions.num_evicted();
  }
  if (settings_.one_task_at_a_time && name.kind == DefinitionKind::kTask) {
    // Asked for again, the other is loaded anew: that is no part of its roll-out's time.
    std::erase_if(evaluator.known, [&](const DefinitionName& other) {
      const bool goes = other.kind == DefinitionKind::kTask;
      if (goes) turn.effects.emplace_back(ForgetDefinition{index, other});
      return goes;
    });
  }
  begin_job(turn, evaluator, State::kLoading, settings_.load_time_limit);
  evaluator.loading = name;
  turn.effects.emplace_back(
      LoadDefinition{index, evaluator.job, name, definitions.find(name)->content});
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

void EvaluatorPool::release(Evaluator& evaluator) {
  evaluator.state = State::kIdle;
  if (!evaluator.killed) idle_.insert(index_of(evaluator));
  evaluator.given.clear();
  evaluator.num_done = 0;
  evaluator.loading.reset();
  evaluator.look_at.reset();
}

}  // namespace treeroll::worker
