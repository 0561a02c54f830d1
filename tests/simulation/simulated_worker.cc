#include "tests/simulation/simulated_worker.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "common/base/check.h"
#include "common/policy/kinds/standard_policies.h"
#include "common/protocol/timings.h"
#include "tests/simulation/gate.h"

namespace treeroll::simulation {
namespace {

using std::chrono::microseconds;

constexpr Duration kStartTime = std::chrono::milliseconds(3);
constexpr Duration kPipeDelay = microseconds(20);
constexpr std::uint32_t kWorkerDice = 100;
constexpr int kSigkill = 9;
constexpr int kSigsegv = 11;
constexpr int kReceiveBufferBytes = 4 << 20;
/// Nothing may be held any more once so many have been killed in each evaluator's place.
constexpr int kKillsOfTrouble = 2;

worker::WorkerSettings settings_of(const Scenario& scenario, Dice& dice, int slot) {
  worker::WorkerSettings settings;
  settings.worker_id = Gate::name_of(scenario.has_keys, slot, dice.id());
  settings.host = "host" + std::to_string(slot / scenario.workers_per_host);
  settings.pid = slot + 1;
  settings.version = "simulated";
  settings.numeric_class = "class";
  settings.num_evaluators = scenario.workers[static_cast<std::size_t>(slot)].num_evaluators;
  settings.batch_bytes_max = scenario.batch_bytes_max;
  return settings;
}

worker::DefinitionFacts facts_of(worker::DefinitionKind kind, const std::string& content,
                                 Duration time_limit) {
  worker::DefinitionFacts facts{.input_dim = 1, .output_dim = 1, .time_limit = time_limit};
  if (kind == worker::DefinitionKind::kTask) return facts;
  // The same few policies come again and again, and reading one takes longer than all the rest.
  static std::map<std::string, int> theta_dims;
  const auto known = theta_dims.find(content);
  if (known != theta_dims.end()) {
    facts.theta_dim = known->second;
    return facts;
  }
  const Result<PolicyPtr> policy = standard_policies().from_json(content);
  CHECK(policy, "the learner publishes a policy that cannot be read");
  facts.theta_dim = (*policy)->theta_dim();
  if (theta_dims.size() > 1000) theta_dims.clear();
  theta_dims.emplace(content, facts.theta_dim);
  return facts;
}

}  // namespace

SimulatedWorker::SimulatedWorker(const Scenario& scenario, Schedule& schedule, Observer& observer,
                                 int slot, int generation, Surroundings surroundings)
    : Node(schedule, scenario.reading_delay),
      scenario_(scenario),
      observer_(observer),
      surroundings_(std::move(surroundings)),
      dice_(scenario.seed, kWorkerDice + static_cast<std::uint32_t>(slot),
            static_cast<std::uint32_t>(generation)),
      settings_(settings_of(scenario, dice_, slot)),
      core_(settings_),
      task_(scenario.seed, scenario.task),
      evaluators_(static_cast<std::size_t>(settings_.num_evaluators)),
      is_liar_(slot == scenario.liar) {
  if (is_liar_) observer_.liars.insert(settings_.worker_id);
}

void SimulatedWorker::drain() {
  if (draining_) return;
  draining_ = true;
  later(Duration{}, [this] { step(worker::DrainRequested{}); });
}

void SimulatedWorker::stop_for(Duration length) {
  stop_until(schedule_.now() + length);
  for (auto& [id, heard] : heard_) heard += length;
}

void SimulatedWorker::kill_evaluators() {
  for (int i = 0; i < settings_.num_evaluators; ++i) {
    if (!evaluators_[static_cast<std::size_t>(i)].up) continue;
    observer_.count("evaluators killed");
    die(i, kPipeDelay, worker::Death::kForeignSignal, kSigkill);
  }
}

void SimulatedWorker::kill_evaluators_until(TimePoint end) {
  observer_.count("workers whose evaluators keep dying");
  killed_until_ = std::max(killed_until_, end);
  kill_evaluators();
}

void SimulatedWorker::stick() { stuck_ = true; }

void SimulatedWorker::on_inbox(std::vector<MessagePointer> messages) {
  for (const MessagePointer& message : messages) {
    if (const auto* batch = std::get_if<protocol::RolloutBatch>(&*message)) {
      heard_[batch->learner_id] = schedule_.now();
    } else if (const auto* status = std::get_if<protocol::LearnerStatus>(&*message)) {
      heard_[status->learner_id] = schedule_.now();
    }
    take(worker::MessageReceived{*message});
  }
  step(worker::InboxDrained{});
}

void SimulatedWorker::on_timer() { step(worker::TimerFired{}); }

void SimulatedWorker::step(const worker::Event& event) {
  take(event);
  if (!std::holds_alternative<worker::InboxDrained>(event)) take(worker::InboxDrained{});
  const TimePoint deadline = core_.next_deadline();
  if (deadline != TimePoint::max()) wake_at(deadline);
}

void SimulatedWorker::take(const worker::Event& event) {
  worker::Effects effects;
  core_.step(schedule_.now(), event, effects);
  for (const worker::Effect& effect : effects) {
    std::visit([this](const auto& what) { perform(what); }, effect);
  }
}

void SimulatedWorker::from_evaluator(int index, Duration delay,
                                     const std::function<worker::Event(Evaluator&)>& what) {
  const std::int64_t incarnation = evaluators_[static_cast<std::size_t>(index)].incarnation;
  later(delay, [this, index, incarnation, what] {
    Evaluator& evaluator = evaluators_[static_cast<std::size_t>(index)];
    if (!evaluator.up || evaluator.incarnation != incarnation) return;
    step(what(evaluator));
  });
}

void SimulatedWorker::die(int index, Duration delay, worker::Death death, int code) {
  from_evaluator(index, delay, [index, death, code](Evaluator& evaluator) {
    const std::int64_t incarnation = evaluator.incarnation;
    const int num_killed = death == worker::Death::kForeignSignal ? evaluator.num_killed + 1 : 0;
    evaluator = {};
    evaluator.incarnation = incarnation + 1;
    evaluator.num_killed = num_killed;
    return worker::EvaluatorDied{index, death, code};
  });
}

void SimulatedWorker::perform(const worker::SendMessage& effect) {
  protocol::Message message = effect.message;
  if (auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    status->receive_buffer_bytes = kReceiveBufferBytes;
    check_room(*status);
    check_learners(*status);
  } else if (const auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
    note_answers(*batch);
  }
  surroundings_.send(std::make_shared<const protocol::Message>(std::move(message)));
}

void SimulatedWorker::check_room(const protocol::WorkerStatus& status) {
  std::size_t num_held = 0;
  for (const protocol::HeldRollouts& held : status.held) num_held += held.keys.size();
  const int capacity = settings_.num_evaluators * settings_.held_per_evaluator_max;
  observer_.require(
      status.free_slots >= 0 && status.free_slots + static_cast<int>(num_held) <= capacity,
      "a worker says it has room that it has not");
  const bool any_ready = std::any_of(evaluators_.begin(), evaluators_.end(),
                                     [](const Evaluator& evaluator) { return evaluator.ready; });
  observer_.require(any_ready || status.free_slots == 0,
                    "a worker without evaluators says it has room");
  const bool in_trouble =
      !any_ready && std::all_of(evaluators_.begin(), evaluators_.end(),
                                [](const Evaluator& e) { return e.num_killed >= kKillsOfTrouble; });
  observer_.require(!in_trouble || num_held == 0,
                    "a worker keeps roll-outs although its evaluators die again and again");
}

void SimulatedWorker::check_learners(const protocol::WorkerStatus& status) {
  for (const protocol::HeldRollouts& held : status.held) {
    const bool is_gone = heard_[held.learner_id] + protocol::kLearnerGone < schedule_.now();
    observer_.require(!is_gone || held.keys.empty(),
                      "a worker keeps the roll-outs of a learner that is gone");
  }
}

void SimulatedWorker::note_answers(const protocol::RewardBatch& batch) {
  auto& answers = observer_.answers[{settings_.worker_id, batch.learner_id}];
  for (std::size_t i = 0; i < batch.results.size(); ++i) {
    const std::int64_t index = batch.first_index + static_cast<std::int64_t>(i);
    const Observer::Question question(batch.results[i].key, batch.results[i].content);
    const auto [place, is_new] = answers.emplace(index, question);
    observer_.require(is_new || place->second == question,
                      "a worker gives one index to two answers");
  }
  observer_.require(
      batch.oldest_index <= observer_.settled[{settings_.worker_id, batch.learner_id}] + 1,
      "a worker drops an answer that is not settled");
  observer_.require(batch.free_slots >= 0, "a worker holds more than it has room for");
}

void SimulatedWorker::perform(const worker::StartEvaluator& effect) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(effect.evaluator)];
  observer_.require(!evaluator.up, "an evaluator is started twice");
  evaluator.up = true;
  if (schedule_.now() < killed_until_ && dice_.chance(.5)) {
    die(effect.evaluator, dice_.between(Duration{}, kStartTime), worker::Death::kForeignSignal,
        kSigkill);
  }
  from_evaluator(effect.evaluator, kStartTime, [index = effect.evaluator](Evaluator& self) {
    self.ready = true;
    return worker::EvaluatorReady{index};
  });
}

/// Without a user's program nobody is asked.
void SimulatedWorker::perform(const worker::EndEvaluator&) {
  observer_.require(false, "an evaluator without a program is asked to end");
}

void SimulatedWorker::perform(const worker::KillEvaluator& effect) {
  evaluators_[static_cast<std::size_t>(effect.evaluator)].num_killed = -1;  // its own fault
  die(effect.evaluator, kPipeDelay, worker::Death::kForeignSignal, kSigkill);
}

void SimulatedWorker::begin(Evaluator& evaluator, std::int64_t job) {
  observer_.require(evaluator.up && evaluator.ready && evaluator.job == 0,
                    "work for an evaluator that is not idle");
  evaluator.job = job;
  evaluator.since = schedule_.now();
  evaluator.cpu_time_max = Duration::max();
}

void SimulatedWorker::perform(const worker::LoadDefinition& effect) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(effect.evaluator)];
  begin(evaluator, effect.job);
  evaluator.cpu_time_max = scenario_.load_time;
  from_evaluator(effect.evaluator, scenario_.load_time, [this, effect](Evaluator& self) {
    self.job = 0;
    self.known.insert(effect.name);
    return worker::DefinitionLoaded{
        .evaluator = effect.evaluator,
        .name = effect.name,
        .accepted = true,
        .text = effect.name.kind == worker::DefinitionKind::kTask
                    ? task_description(scenario_.task, settings_.pid % 2 == 0)
                    : "",
        .facts = facts_of(effect.name.kind, effect.content, scenario_.task.time_limit)};
  });
}

void SimulatedWorker::perform(const worker::ForgetDefinition& effect) {
  const std::size_t num_erased =
      evaluators_[static_cast<std::size_t>(effect.evaluator)].known.erase(effect.name);
  observer_.require(num_erased == 1, "an evaluator is to forget what it does not know");
}

void SimulatedWorker::perform(const worker::RunRollouts& effect) {
  observer_.require(!effect.requests.empty(), "an evaluator is given nothing");
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(effect.evaluator)];
  begin(evaluator, effect.job);
  evaluator.lost = false;
  evaluator.ahead = {};
  std::int64_t job = effect.job;
  for (const protocol::RolloutRequest& request : effect.requests) {
    if (job > effect.job) observer_.count("roll-outs beside others");
    evaluate(effect.evaluator, job, request, &request == &effect.requests.back());
    ++job;
  }
}

/// @param is_last  of those it was given together
void SimulatedWorker::evaluate(int index, std::int64_t job, const protocol::RolloutRequest& request,
                               bool is_last) {
  Evaluator& evaluator = evaluators_[static_cast<std::size_t>(index)];
  observer_.require(
      evaluator.known.contains({worker::DefinitionKind::kTask, request.task_id}) &&
          evaluator.known.contains({worker::DefinitionKind::kPolicy, request.policy_id}),
      "a roll-out for an evaluator that lacks a definition");
  if (evaluator.lost) return;
  ++observer_.num_simulations;

  const Duration own = dice_.between(scenario_.task.duration_min, scenario_.task.duration_max);
  evaluator.ahead += own;
  const Duration duration = evaluator.ahead;
  evaluator.lost = true;
  if (schedule_.now() < killed_until_) {
    die(index, dice_.between(Duration{}, duration), worker::Death::kForeignSignal, kSigkill);
    return;
  }
  if (stuck_) {
    observer_.count("roll-outs that never end");
    return;
  }
  const Fate fate = task_.fate(request.key);
  const bool crashes =
      fate == Fate::kCrashes || (fate == Fate::kFlaky && num_flaky_deaths_[request.key] < 2);
  if (crashes) {
    ++num_flaky_deaths_[request.key];
    observer_.count("evaluators crashed");
    die(index, duration, worker::Death::kFatalSignal, kSigsegv);
    return;
  }
  if (fate == Fate::kHangs) {
    observer_.count("evaluators hung");
    if (request.key.number % 2 == 0) evaluator.cpu_time_max = duration;  // blocked, not busy
    return;
  }
  evaluator.lost = false;
  evaluator.cpu_time_max = duration;
  const Outcome outcome =
      said(request, task_.outcome(request.key, request.task_seed, request.theta));
  if (outcome.status() == RolloutStatus::kDiverged) observer_.count("roll-outs diverged");
  if (outcome.is_discarded()) observer_.count("trials discarded");
  from_evaluator(index, duration, [index, job, own, outcome, is_last](Evaluator& self) {
    if (is_last) self.job = 0;
    self.num_killed = 0;
    return worker::RolloutEvaluated{
        .evaluator = index, .job = job, .outcome = outcome, .duration_ns = own.count()};
  });
}

/// A liar says the same lie of a question each time, and each liar one of its own.
Outcome SimulatedWorker::said(const protocol::RolloutRequest& request, Outcome outcome) {
  if (!is_liar_ || !outcome.is_ok()) return outcome;
  Dice dice(static_cast<std::uint64_t>(settings_.worker_id),
            static_cast<std::uint32_t>(request.key.run),
            static_cast<std::uint32_t>(request.key.number));
  if (!dice.chance(scenario_.lying_share)) return outcome;
  observer_.count("lies");
  return Outcome::ok(dice.between(0., 1.));
}

void SimulatedWorker::perform(const worker::AskCpuTime& effect) {
  from_evaluator(effect.evaluator, kPipeDelay, [this, effect](Evaluator& self) {
    const Duration elapsed = schedule_.now() - self.since;
    return worker::CpuTimeMeasured{effect.evaluator, effect.job,
                                   std::min(elapsed, self.cpu_time_max)};
  });
}

void SimulatedWorker::perform(const worker::Exit& effect) {
  observer_.require(draining_ && effect.status == 0, "a worker leaves without being asked");
  surroundings_.exited();
}

}  // namespace treeroll::simulation
