#include "workers/core/evaluator_pool.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

/// Told to forget at most so many definitions before one piece of work, so that these small
/// messages always fit the socket beside it.
constexpr int kForgetsPerJobMax = 16;

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

bool EvaluatorPool::end_work(const Turn& turn, const RolloutName& name) {
  for (int i = 0; i < settings_.num_evaluators; ++i) {
    Evaluator& evaluator = at(i);
    const bool has_it =
        std::ranges::any_of(evaluator.given, [&](const Given& g) { return g.work.name == name; });
    if (!has_it) continue;
    if (evaluator.runs_once) return false;
    if (evaluator.killed) continue;
    evaluator.dismissed = true;
    kill(turn, i);
  }
  withdraw(name);
  return true;
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

/// Gives the evaluator what its work still needs, at last the roll-outs that are still wanted.
/// Precondition: one is.
void EvaluatorPool::continue_work(const Turn& turn, int index, DefinitionShelf& definitions) {
  Evaluator& evaluator = at(index);
  // The definitions of what is not wanted may be gone.
  std::erase_if(evaluator.given, [](const Given& given) { return !given.wanted; });
  const auto lacks = [&](const DefinitionName& name) {
    definitions.touch(name);
    return !evaluator.known.contains(name);
  };
  const DefinitionName task{DefinitionKind::kTask, evaluator.given.front().work.request.task_id};
  if (lacks(task)) return load(turn, index, task, definitions);
  for (const Given& given : evaluator.given) {
    const DefinitionName policy{DefinitionKind::kPolicy, given.work.request.policy_id};
    if (lacks(policy)) return load(turn, index, policy, definitions);
  }
  const std::int64_t count = std::ssize(evaluator.given);
  const DefinitionFacts& facts = definitions.find(task)->facts;
  begin_job(turn, evaluator, State::kRunning, count * facts.time_limit);
  evaluator.runs_once = !facts.repeatable;
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

void EvaluatorPool::release(Evaluator& evaluator) {
  evaluator.state = State::kIdle;
  evaluator.given.clear();
  evaluator.num_done = 0;
  evaluator.runs_once = false;
  evaluator.loading.reset();
  if (evaluator.killed) return;  // the end of its grace is still looked at
  idle_.insert(index_of(evaluator));
  evaluator.look_at.reset();
}

}  // namespace treeroll::worker
