#include "tests/simulation/simulated_learner.h"

#include <string>
#include <utility>

#include "common/protocol/wire_sizes.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kLearnerDice = 10;

learner::LearnerSettings learner_settings(const Scenario& scenario, protocol::LearnerId id) {
  learner::LearnerSettings settings;
  settings.learner_id = id;
  settings.batch_bytes_max = scenario.batch_bytes_max;
  settings.word_bytes = scenario.has_keys ? protocol::kWordMacBytes : 0;
  settings.is_authenticated = scenario.has_keys;
  settings.unsynced_results_max = scenario.unsynced_results_max;
  if (scenario.knows_task) {
    settings.known_tasks[kTaskContent] =
        *task_description_from_json(task_description(scenario.task, true));
  }
  return settings;
}

}  // namespace

SimulatedLearner::SimulatedLearner(const Scenario& scenario, int index, Schedule& schedule,
                                   Observer& observer, Disk& disk, int generation,
                                   Surroundings surroundings)
    : Node(schedule, scenario.reading_delay),
      scenario_(scenario),
      study_(scenario.studies[static_cast<std::size_t>(index)]),
      observer_(observer),
      disk_(disk),
      surroundings_(std::move(surroundings)),
      dice_(scenario.seed, kLearnerDice + static_cast<std::uint32_t>(index),
            static_cast<std::uint32_t>(generation)),
      id_(dice_.id()),
      task_(scenario.seed, scenario.task),
      core_(study_, learner_settings(scenario, id_)),
      num_applied_(static_cast<std::size_t>(study_.num_runs())) {}

void SimulatedLearner::start() {
  learner::Effects unsent;
  started_at_ = schedule_.now();
  core_.step(schedule_.now(), learner::Started{}, unsent);
  const std::string damage = disk_.open([this](const JournalRecord& record) { recover(record); });
  observer_.require(damage.empty(), "its own journal cannot be read: " + damage);
  observer_.require(core_.outcome() != learner::LearnerCore::Outcome::kFailed,
                    "its own journal is refused: " + core_.failure());
  disk_.append(JournalStart{.learner_id = id_});
  disk_.sync();
  check_counters();
  step(learner::RecoveryFinished{});
  step(learner::TimerFired{});
}

void SimulatedLearner::recover(const JournalRecord& record) {
  if (core_.outcome() == learner::LearnerCore::Outcome::kFailed) return;
  learner::Effects unsent;
  if (const auto* result = std::get_if<AcceptedResult>(&record)) {
    note_answered(*result);
    accepted_.emplace(result->key, result->content);
    synced_.emplace(result->key, result->content);
    core_.step(schedule_.now(), learner::ResultRecovered{*result}, unsent);
  } else if (const auto* second = std::get_if<SecondAnswer>(&record)) {
    answered_by_[second->result.key].insert(second->result.worker_id);
    core_.step(schedule_.now(), learner::SecondRecovered{*second}, unsent);
  } else if (const auto* worker = std::get_if<KnownWorker>(&record)) {
    core_.step(schedule_.now(), learner::WorkerRecovered{*worker}, unsent);
  } else if (const auto* signals = std::get_if<TaskSignals>(&record)) {
    core_.step(schedule_.now(), learner::SignalsRecovered{*signals}, unsent);
  } else if (const auto* time = std::get_if<LearningTime>(&record)) {
    learnt_before_ = time->elapsed;
    note_time(*time);
    core_.step(schedule_.now(), learner::TimeRecovered{*time}, unsent);
  }
}

void SimulatedLearner::stop() {
  later(Duration{}, [this] { step(learner::StopRequested{}); });
}

void SimulatedLearner::on_inbox(std::vector<MessagePointer> messages) {
  for (const MessagePointer& message : messages) {
    take(learner::MessageReceived{*message});
    hear(*message);
  }
  step(learner::InboxDrained{});
}

void SimulatedLearner::on_timer() {
  step(learner::TimerFired{});
  check_leases_of_the_silent();
}

void SimulatedLearner::step(const learner::Event& event) {
  take(event);
  if (dead_ || ended_) return;
  if (core_.outcome() == learner::LearnerCore::Outcome::kRunning)
    return wake_at(core_.next_deadline());
  observer_.require(core_.outcome() != learner::LearnerCore::Outcome::kFailed,
                    "the learner fails: " + core_.failure());
  if (is_sync_planned_) return;  // end_sync() comes
  disk_.append(JournalSeal{});
  disk_.sync();
  ended_ = true;
  surroundings_.ended();
}

void SimulatedLearner::take(const learner::Event& event) {
  if (dead_) return;
  learner::Effects effects;
  core_.step(schedule_.now(), event, effects);
  do_all(effects);
  if (!dead_) check_counters();
}

void SimulatedLearner::do_all(const learner::Effects& effects) {
  int count = 0;
  for (const learner::Effect& effect : effects) {
    if (std::holds_alternative<learner::SendMessage>(effect)) count += 1;
    const bool is_record = std::holds_alternative<learner::AppendResult>(effect) ||
                           std::holds_alternative<learner::AppendSecond>(effect) ||
                           std::holds_alternative<learner::AppendWorker>(effect) ||
                           std::holds_alternative<learner::AppendSignals>(effect) ||
                           std::holds_alternative<learner::AppendTime>(effect);
    if (is_record) count += 2;
  }
  effects_until_crash_ = crash_is_due_ && count > 0 ? dice_.between(0, count) : -1;
  try {
    learner::carry_out(effects, *this);
    if (effects_until_crash_ >= 0) crash();
  } catch (const Crashed&) {
    crash();
  }
}

void SimulatedLearner::crash_if_due() {
  if (effects_until_crash_-- == 0) throw Crashed{};
}

void SimulatedLearner::crash() {
  dead_ = true;
  switch (disk_.crash(dice_)) {
    case Disk::Loss::kTorn:
      observer_.count("journal tails torn");
      break;
    case Disk::Loss::kZeros:
      observer_.count("journal tails reading as zeros");
      break;
    case Disk::Loss::kNothing:
      break;
  }
  surroundings_.crashed();
}

void SimulatedLearner::append(const AcceptedResult& result) {
  crash_if_due();
  check_answer(result);
  observer_.require(accepted_.emplace(result.key, result.content).second,
                    "a roll-out is accepted twice");
  if (result.outcome.is_discarded()) expected_.erase(result.key);
  disk_.append(result);
  unwritten_.push_back(result);
  note_answered(result);
  plan_sync();
  observer_.require(lag() <= scenario_.unsynced_results_max,
                    "more is accepted than may wait for the disk");
  if (lag() == scenario_.unsynced_results_max) observer_.count("the disk's lag at its limit");
}

void SimulatedLearner::append(const SecondAnswer& answer) {
  crash_if_due();
  const AcceptedResult& result = answer.result;
  check_answer(result);
  observer_.require(accepted_.contains({result.key, result.content}),
                    "what has no result has a second answer");
  observer_.require(answered_by_[result.key].insert(result.worker_id).second,
                    "a worker is asked again what it has answered");
  observer_.count("second answers");
  disk_.append(answer);
  unwritten_.push_back(result);
  open_.erase(result.key);
  plan_sync();
  observer_.require(lag() <= scenario_.unsynced_results_max,
                    "more is accepted than may wait for the disk");
  check_outvoted();
}

void SimulatedLearner::append(const KnownWorker& worker) {
  crash_if_due();
  disk_.append(worker);
  plan_sync();
}

void SimulatedLearner::append(const TaskSignals& signals) {
  crash_if_due();
  observer_.count("names of signals noted");
  disk_.append(signals);
  plan_sync();
}

void SimulatedLearner::append(const LearningTime& time) {
  crash_if_due();
  Duration counted = learnt_before_ + (schedule_.now() - started_at_);
  // Not up before the runs that leave a layer have their new one.
  if (waits_for_a_switch()) counted = std::min(counted, *study_.stop_after - Duration(1));
  observer_.require(time.elapsed == counted, "the time of learning is not counted");
  disk_.append(time);
  time_is_unwritten_ = true;
  note_time(time);
  plan_sync();
}

void SimulatedLearner::flush() {
  crash_if_due();
  write();
}

void SimulatedLearner::write() {
  disk_.flush();
  for (const AcceptedResult& result : std::exchange(unwritten_, {})) {
    unsynced_.emplace_back(result.key, result.content);
  }
  time_is_unwritten_ = false;
}

void SimulatedLearner::plan_sync() {
  is_unsynced_ = true;
  if (std::exchange(is_sync_planned_, true)) return;
  later(scenario_.sync_delay, [this] { begin_sync(); });
}

void SimulatedLearner::begin_sync() {
  if (dead_) return;
  is_unsynced_ = false;
  write();
  disk_.begin_sync();
  syncing_ = std::exchange(unsynced_, {});
  step(learner::SyncBegun{});
  later(scenario_.sync_delay, [this] { end_sync(); });
}

void SimulatedLearner::end_sync() {
  if (dead_) return;
  is_sync_planned_ = false;
  disk_.end_sync();
  synced_.insert(syncing_.begin(), syncing_.end());
  syncing_.clear();
  if (is_unsynced_) plan_sync();
  step(learner::JournalSynced{});
}

void SimulatedLearner::send(const protocol::Message& message) {
  crash_if_due();
  observer_.require(unwritten_.empty() && !time_is_unwritten_,
                    "a message leaves before what it may follow from is written");
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) check_batch(*batch);
  check_told(message);
  surroundings_.send(std::make_shared<const protocol::Message>(message));
}

void SimulatedLearner::note_answered(const AcceptedResult& result) {
  const protocol::RolloutKey key = result.key;
  open_.erase(key);
  if (result.outcome.is_discarded() && ++num_discards_[key] <= study_.discards_max) return;
  if (result.outcome.is_discarded()) observer_.count("roll-outs given up");
  answered_.emplace(key, result.outcome);
  answered_by_[key].insert(result.worker_id);
  if (key.number < 0) return;
  int& applied = num_applied_[static_cast<std::size_t>(key.run)];
  const auto apply = [&](int number) {
    ++applied;
    num_failed_ += answered_.at({key.run, number}).is_ok() ? 0 : 1;
  };
  if (!study_.in_sequence) return apply(key.number);
  while (answered_.contains({key.run, applied})) apply(applied);
}

}  // namespace treeroll::simulation
