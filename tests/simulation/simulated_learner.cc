#include "tests/simulation/simulated_learner.h"

#include <numeric>
#include <string>
#include <utility>

#include "common/transport/codec.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kLearnerDice = 4;

}  // namespace

LearnerSettings learner_settings(const Scenario& scenario, protocol::LearnerId id) {
  LearnerSettings settings;
  settings.learner_id = id;
  settings.batch_bytes_max = scenario.batch_bytes_max;
  if (scenario.knows_task) {
    settings.known_tasks[kTaskContent] = *task_facts_from_json(kTaskDescription);
  }
  return settings;
}

SimulatedLearner::SimulatedLearner(const Scenario& scenario, Schedule& schedule, Observer& observer,
                                   Disk& disk, int generation, Surroundings surroundings)
    : Node(schedule, scenario.reading_delay),
      scenario_(scenario),
      observer_(observer),
      disk_(disk),
      surroundings_(std::move(surroundings)),
      dice_(scenario.seed, kLearnerDice, static_cast<std::uint32_t>(generation)),
      id_(dice_.id()),
      task_(scenario.seed, scenario.task),
      core_(scenario.study, learner_settings(scenario, id_)),
      num_applied_(static_cast<std::size_t>(scenario.study.num_runs())) {}

void SimulatedLearner::start() {
  take(learner_event::Started{});
  const std::vector<AcceptedResult> journal = disk_.journal;
  for (const AcceptedResult& result : journal) {
    if (dead_) return;
    note_answered(result.key);
    synced_.insert(result.key);
    take(learner_event::Recovered{&result});
  }
  step(learner_event::InboxDrained{});
}

void SimulatedLearner::stop() {
  later(Duration{}, [this] { step(learner_event::StopRequested{}); });
}

void SimulatedLearner::on_inbox(std::vector<MessagePointer> messages) {
  for (const MessagePointer& message : messages) take(learner_event::Received{message.get()});
  step(learner_event::InboxDrained{});
}

void SimulatedLearner::on_timer() { step(learner_event::Timer{}); }

void SimulatedLearner::step(const LearnerEvent& event) {
  take(event);
  if (dead_ || ended_) return;
  if (core_.outcome() == LearnerCore::Outcome::kRunning) return wake_at(core_.next_deadline());
  observer_.require(core_.outcome() != LearnerCore::Outcome::kFailed,
                    "the learner fails: " + core_.failure());
  if (disk_.num_synced < disk_.journal.size()) return;  // sync() comes
  ended_ = true;
  surroundings_.ended();
}

void SimulatedLearner::take(const LearnerEvent& event) {
  if (dead_) return;
  LearnerEffects effects;
  core_.step(schedule_.now(), event, effects);
  carry_out(effects);
  if (!dead_) check_counters();
}

void SimulatedLearner::carry_out(const LearnerEffects& effects) {
  const int count = static_cast<int>(effects.accepted.size() + effects.send.size());
  const int crash_before = crash_is_due_ && count > 0 ? dice_.between(0, count) : -1;
  int place = 0;
  for (const AcceptedResult& result : effects.accepted) {
    if (place++ == crash_before) return crash();
    write(result);
  }
  for (const protocol::Message& message : effects.send) {
    if (place++ == crash_before) return crash();
    send(message);
  }
  if (place == crash_before) crash();
}

void SimulatedLearner::crash() {
  dead_ = true;
  const std::size_t num_unsynced = disk_.journal.size() - disk_.num_synced;
  const int num_lost = dice_.between(0, static_cast<int>(num_unsynced));
  observer_.count("accepted results lost by the disk", num_lost);
  disk_.journal.resize(disk_.journal.size() - static_cast<std::size_t>(num_lost));
  disk_.num_synced = disk_.journal.size();
  surroundings_.crashed();
}

void SimulatedLearner::write(const AcceptedResult& result) {
  const auto expected = expected_.find(result.key);
  observer_.require(expected != expected_.end(), "a result that nobody asked for is accepted");
  if (expected != expected_.end()) {
    observer_.require(expected->second.content == result.content,
                      "the answer to another question is accepted");
    observer_.require(expected->second.reward == result.reward, "a wrong reward is accepted");
    observer_.require(task_.status(result.key) == result.status, "a wrong status is accepted");
  }
  observer_.require(!answered_.contains(result.key), "a roll-out is accepted twice");
  disk_.journal.push_back(result);
  note_answered(result.key);
  if (sync_is_due_) return;
  sync_is_due_ = true;
  later(scenario_.sync_delay, [this] { sync(); });
}

void SimulatedLearner::sync() {
  if (dead_) return;
  sync_is_due_ = false;
  for (std::size_t i = disk_.num_synced; i < disk_.journal.size(); ++i) {
    synced_.insert(disk_.journal[i].key);
  }
  disk_.num_synced = disk_.journal.size();
  step(learner_event::Synced{});
}

void SimulatedLearner::send(const protocol::Message& message) {
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) check_batch(*batch);
  surroundings_.send(std::make_shared<const protocol::Message>(message));
}

void SimulatedLearner::note_answered(protocol::RolloutKey key) {
  answered_.insert(key);
  if (key.number < 0) return;
  int& applied = num_applied_[static_cast<std::size_t>(key.run)];
  const auto apply = [&](int number) {
    ++applied;
    num_failed_ += task_.status({key.run, number}) == RolloutStatus::kOk ? 0 : 1;
  };
  if (!scenario_.study.in_sequence) return apply(key.number);
  while (answered_.contains({key.run, applied})) apply(applied);
}

void SimulatedLearner::check_batch(const protocol::RolloutBatch& batch) {
  observer_.require(batch.sequence == ++last_sequence_, "a batch out of sequence");
  if (batch.rollouts.size() > 1) {
    observer_.require(transport::encode(batch).size() <= scenario_.batch_bytes_max,
                      "a batch is larger than it may be");
  }
  for (const protocol::RolloutRequest& request : batch.rollouts) {
    const protocol::RolloutKey key = request.key;
    observer_.require(!answered_.contains(key), "an answered roll-out is asked for");
    const Condition& condition =
        scenario_.study.conditions[static_cast<std::size_t>(key.run / scenario_.study.repetitions)];
    const int applied = num_applied_[static_cast<std::size_t>(key.run)];
    observer_.require(key.number < condition.exploration.num_rollouts,
                      "a roll-out past the budget is asked for");
    observer_.require(scenario_.study.in_sequence == false ||
                          key.number < applied + condition.exploration.in_flight,
                      "more roll-outs are in flight than may be");
    const auto [place, is_new] =
        expected_.emplace(key, Expected{request.content, task_.reward(key, request.theta)});
    observer_.require(is_new || place->second.content == request.content,
                      "a roll-out is asked again with another question");
  }
  for (const protocol::Acknowledgement& acknowledgement : batch.acknowledgements) {
    auto& answers = observer_.answers[{acknowledgement.worker_id, id_}];
    while (!answers.empty() && answers.begin()->first <= acknowledgement.result_index) {
      observer_.require(synced_.contains(answers.begin()->second),
                        "an answer is acknowledged that is not on stable storage");
      answers.erase(answers.begin());
    }
  }
}

void SimulatedLearner::check_counters() {
  const LedgerCounters counters = core_.counters();
  const auto applied = std::accumulate(num_applied_.begin(), num_applied_.end(), std::int64_t{0});
  // After a failure or the end, and within recovery, nothing is drawn any more.
  observer_.require(counters.applied == applied, "applied results are not what the journal has");
  observer_.require(counters.issued == counters.applied + counters.pending,
                    "issued is not applied and pending");
  observer_.require(counters.pending >= 0 && counters.pending <= num_in_flight(scenario_),
                    "more is pending than may be in flight");
  observer_.require(counters.failed == num_failed_, "failed results are not those applied");
  observer_.require(counters.rejected == 0 && counters.conflicting == 0,
                    "a sound worker's answer is rejected");
  observer_.num_reissued += counters.reissued - std::exchange(num_reissued_, counters.reissued);
}

}  // namespace treeroll::simulation
