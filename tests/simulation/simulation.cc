#include "tests/simulation/simulation.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace treeroll::simulation {
namespace {

using std::chrono::seconds;
using Kind = Incident::Kind;

/// More actions than any scenario takes: what goes past it goes round in circles.
constexpr int kActionsMax = 5'000'000;

bool same(const RunRecord& a, const RunRecord& b) {
  if (a.rollouts.size() != b.rollouts.size()) return false;
  for (std::size_t i = 0; i < a.rollouts.size(); ++i) {
    const RolloutRecord& x = a.rollouts[i];
    const RolloutRecord& y = b.rollouts[i];
    if (x.reward != y.reward || x.layer != y.layer || x.status != y.status) return false;
  }
  return a.final_reward == b.final_reward && a.switches == b.switches &&
         a.best_rollout == b.best_rollout && a.best_reward == b.best_reward &&
         a.best_policy == b.best_policy;
}

std::vector<RunRecord> folded_records(const Scenario& scenario, const Disk& disk) {
  LearnerCore core(scenario.study, learner_settings(scenario, 1));
  LearnerEffects effects;
  core.step(TimePoint{}, learner_event::Started{}, effects);
  for (const AcceptedResult& result : disk.journal) {
    core.step(TimePoint{}, learner_event::Recovered{&result}, effects);
  }
  return core.run_records();
}

}  // namespace

std::vector<RunRecord> faultless_records(const Scenario& scenario) {
  const VirtualTask task(scenario.seed, scenario.task);
  std::vector<RunRecord> records;
  for (int index = 0; index < scenario.study.num_runs(); ++index) {
    Run run(scenario.study, index);
    while (!run.done()) {
      for (const Run::Wanted& wanted : run.take_wanted()) {
        const protocol::RolloutKey key{index, wanted.number};
        const std::vector<double> theta(wanted.theta.data(),
                                        wanted.theta.data() + wanted.theta.size());
        run.accept(wanted.number, task.reward(key, theta), task.status(key), 0);
      }
    }
    records.push_back(run.record());
  }
  return records;
}

Simulation::Simulation(const Scenario& scenario)
    : scenario_(scenario),
      network_(scenario, schedule_, observer_,
               [this](int slot, Network::Direction direction, Node::MessagePointer message) {
                 if (direction == Network::Direction::kToLearner) {
                   if (learner_) learner_->deliver(std::move(message));
                 } else if (auto& worker = workers_[static_cast<std::size_t>(slot)]) {
                   worker->deliver(std::move(message));
                 }
               }),
      workers_(scenario.workers.size()),
      generations_(scenario.workers.size()),
      absence_(scenario.workers.size()) {}

void Simulation::run() {
  schedule_.at(TimePoint{}, [this] { start_learner(); });
  for (int slot = 0; slot < static_cast<int>(scenario_.workers.size()); ++slot) {
    const TimePoint joins = scenario_.workers[static_cast<std::size_t>(slot)].joins;
    if (joins > TimePoint{}) observer_.count("workers joining late");
    schedule_.at(joins, [this, slot] { start_worker(slot); });
  }
  for (const Incident& incident : scenario_.incidents) {
    schedule_.at(incident.time, [this, &incident] { strike(incident); });
  }
  const TimePoint end = scenario_.faults_end + patience();
  int num_actions = 0;
  while (!done_ && !observer_.broken()) {
    if (schedule_.advance(end) && ++num_actions < kActionsMax) continue;
    const LedgerCounters counters = learner_ ? learner_->core().counters() : LedgerCounters{};
    observer_.require(
        false, "no end although faults have stopped: " + std::to_string(counters.applied) + " of " +
                   std::to_string(num_rollouts(scenario_)) + " applied");
  }
}

void Simulation::start_learner() {
  SimulatedLearner::Surroundings surroundings;
  surroundings.send = [this](const Node::MessagePointer& message) {
    for (int slot = 0; slot < static_cast<int>(workers_.size()); ++slot) {
      network_.send(slot, Network::Direction::kToWorker, message);
    }
  };
  surroundings.crashed = [this] {
    observer_.count("learner crashes");
    schedule_.after(Duration{}, [this] {
      learner_.reset();
      schedule_.after(learner_absence_, [this] { start_learner(); });
    });
  };
  surroundings.ended = [this] { schedule_.after(Duration{}, [this] { learner_ended(); }); };
  learner_ = std::make_unique<SimulatedLearner>(scenario_, schedule_, observer_, disk_,
                                                learner_generation_++, std::move(surroundings));
  learner_->start();
}

void Simulation::learner_ended() {
  if (!learner_) return;
  if (learner_->core().outcome() == LearnerCore::Outcome::kDone) {
    check_outcome();
    done_ = true;
    return;
  }
  learner_.reset();
  schedule_.after(learner_absence_, [this] { start_learner(); });
}

void Simulation::start_worker(int slot) {
  const auto place = static_cast<std::size_t>(slot);
  const int generation = generations_[place]++;
  workers_[place] = std::make_unique<SimulatedWorker>(
      scenario_, schedule_, observer_, slot, generation,
      SimulatedWorker::Surroundings{[this, slot](const Node::MessagePointer& message) {
                                      network_.send(slot, Network::Direction::kToLearner, message);
                                    },
                                    [this, slot, place, generation] {
                                      schedule_.after(Duration{}, [this, slot, place, generation] {
                                        if (generations_[place] == generation + 1)
                                          remove_worker(slot, absence_[place]);
                                      });
                                    }});
  workers_[place]->start();
}

void Simulation::remove_worker(int slot, Duration rejoins_after) {
  auto& worker = workers_[static_cast<std::size_t>(slot)];
  if (!worker) return;
  worker.reset();
  schedule_.after(rejoins_after, [this, slot] { start_worker(slot); });
}

void Simulation::strike(const Incident& incident) {
  const auto place = static_cast<std::size_t>(incident.slot);
  SimulatedWorker* worker = workers_[place].get();
  const TimePoint end = schedule_.now() + incident.length;
  switch (incident.kind) {
    case Kind::kWorkerCrash:
      if (!worker) return;
      observer_.count("worker crashes");
      return remove_worker(incident.slot, incident.length);
    case Kind::kWorkerDrain:
      if (!worker) return;
      observer_.count("workers drained");
      absence_[place] = incident.length;
      return worker->drain();
    case Kind::kWorkerStop:
      if (!worker) return;
      observer_.count("workers stopped for a while");
      return worker->stop_until(end);
    case Kind::kEvaluatorsKilled:
      if (worker) worker->kill_evaluators();
      return;
    case Kind::kPartition:
      observer_.count("partitions");
      return network_.cut(incident.slot, end);
    case Kind::kLearnerCrash:
      if (!learner_) return;
      learner_absence_ = incident.length;
      return learner_->crash_at_next_effect();
    case Kind::kLearnerExit:
      if (!learner_) return;
      observer_.count("learner asked to stop");
      learner_absence_ = incident.length;
      return learner_->stop();
    case Kind::kLearnerStop:
      if (!learner_) return;
      observer_.count("learner stopped for a while");
      return learner_->stop_until(end);
  }
}

Duration Simulation::patience() const {
  // A roll-out that hangs takes three evaluators, each blocked for ten times its limit and a
  // second; so long may a learner also wait for one that was lost together with its worker.
  const Duration hanging = 3 * (10 * kTaskTimeLimit + seconds(1));
  Duration sum = seconds(60);
  const VirtualTask task(scenario_.seed, scenario_.task);
  for (int run = 0; run < scenario_.study.num_runs(); ++run) {
    const Condition& condition =
        scenario_.study.conditions[static_cast<std::size_t>(run / scenario_.study.repetitions)];
    for (int number = -1; number < condition.exploration.num_rollouts; ++number) {
      sum += task.fate({run, number}) == Fate::kHangs
                 ? hanging
                 : 4 * scenario_.task.duration_max + 2 * scenario_.network.delay_max +
                       std::chrono::milliseconds(20);
    }
  }
  return sum;
}

void Simulation::check_outcome() {
  const std::vector<RunRecord> records = learner_->core().run_records();
  const auto expected = static_cast<std::size_t>(num_rollouts(scenario_)) + records.size();
  observer_.require(disk_.journal.size() == expected, "the journal has not each answer once");
  std::set<protocol::RolloutKey> keys;
  for (const AcceptedResult& result : disk_.journal) keys.insert(result.key);
  observer_.require(keys.size() == expected, "the journal has an answer twice");
  for (const RunRecord& run : records) {
    const Condition& condition =
        scenario_.study.conditions[static_cast<std::size_t>(run.run / scenario_.study.repetitions)];
    observer_.require(
        run.rollouts.size() == static_cast<std::size_t>(condition.exploration.num_rollouts),
        "a run has not exactly its roll-outs");
    observer_.require(std::none_of(run.rollouts.begin(), run.rollouts.end(),
                                   [](const auto& rollout) { return rollout.layer == 0; }),
                      "a roll-out has no result");
    observer_.require(run.final_reward.has_value(), "a run has no final evaluation");
    observer_.require(run.switches.size() == 1, "a run has not switched its layer");
    if (run.repetition == 0) continue;
    const std::vector<RolloutRecord>& others =
        records[static_cast<std::size_t>(run.run - run.repetition)].rollouts;
    observer_.require(
        !std::equal(run.rollouts.begin(), run.rollouts.end(), others.begin(), others.end(),
                    [](const auto& a, const auto& b) { return a.reward == b.reward; }),
        "two repetitions draw the same");
  }
  const auto compare = [&](const std::vector<RunRecord>& others, const char* rule) {
    for (std::size_t i = 0; i < records.size(); ++i) {
      observer_.require(same(records[i], others[i]), rule);
    }
  };
  compare(folded_records(scenario_, disk_), "the fold of the journal is another result");
  if (!scenario_.study.in_sequence) return;
  compare(faultless_records(scenario_), "the result is not that without faults");
}

}  // namespace treeroll::simulation
