#include "tests/simulation/simulation.h"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "learner/results/run_counts.h"
#include "tests/simulation/broken_check.h"
#include "tests/simulation/reference.h"

namespace treeroll::simulation {
namespace {

using std::chrono::seconds;
using Kind = Incident::Kind;

/// More actions than any scenario takes: what goes past it goes round in circles.
constexpr std::int64_t kActionsMax = 5'000'000;
constexpr std::int64_t kActionsPerWorkerMax = 100'000;

/// What a journal says of the ends of its runs, counted apart from the core.
struct Ends {
  std::set<protocol::RolloutKey> keys;  ///< of all results
  std::size_t num_results = 0;          ///< but for trials that were made again
  std::map<protocol::RolloutKey, int> num_discards;
  bool time_was_up = false;
  std::vector<int> num_applied;  ///< by run, when the time was up; empty if it was not
};

Ends ends_of(const Study& study, const std::vector<JournalRecord>& journal) {
  Ends ends;
  std::vector<int> num_applied(static_cast<std::size_t>(study.num_runs()));
  for (const JournalRecord& record : journal) {
    if (const auto* result = std::get_if<AcceptedResult>(&record)) {
      const bool is_discarded = result->outcome.is_discarded();
      if (is_discarded && ++ends.num_discards[result->key] <= study.discards_max) continue;
      ++ends.num_results;
      ends.keys.insert(result->key);
      const int run = result->key.run;
      int& applied = num_applied[static_cast<std::size_t>(run)];
      if (result->key.number < 0) continue;
      if (!study.in_sequence) ++applied;
      while (study.in_sequence && ends.keys.contains({run, applied})) ++applied;
    } else if (const auto* time = std::get_if<LearningTime>(&record)) {
      if (time->elapsed < *study.stop_after) continue;
      ends.time_was_up = true;
      ends.num_applied = num_applied;
    }
  }
  return ends;
}

}  // namespace

Simulation::Simulation(const Scenario& scenario)
    : scenario_(scenario),
      network_(scenario, schedule_, observer_,
               [this](int link, Network::Direction direction, const Node::MessagePointer& message) {
                 deliver(link, direction, message);
               }),
      learners_(scenario.studies.size()),
      relays_(static_cast<std::size_t>(scenario.num_relays)),
      workers_(scenario.workers.size()),
      gates_(scenario.workers.size()),
      generations_(scenario.workers.size()),
      stuck_(scenario.workers.size()),
      absence_(scenario.workers.size()) {}

void Simulation::deliver(int link, Network::Direction direction,
                         const Node::MessagePointer& message) {
  const auto place = static_cast<std::size_t>(link);
  const bool is_of_relay = place >= workers_.size();
  if (direction == Network::Direction::kToWorker) {
    Node* below = nullptr;
    if (is_of_relay) {
      below = relays_[place - workers_.size()].process.get();
    } else {
      below = workers_[place].get();
    }
    if (below == nullptr) return;
    Gate& gate = is_of_relay ? relays_[place - workers_.size()].gate_above : gates_[place];
    if (gate.admits(*message)) below->deliver(message);
    return;
  }
  const int relay = is_of_relay ? -1 : scenario_.workers[place].relay;
  if (relay >= 0) {
    RelaySlot& above = relays_[static_cast<std::size_t>(relay)];
    if (above.process && above.gate_below.admits(*message)) above.process->deliver(message);
    return;
  }
  ++observer_.num_messages_heard;
  observer_.num_heartbeats += std::holds_alternative<protocol::WorkerStatus>(*message) ? 1 : 0;
  for (LearnerSlot& learner : learners_) {
    if (learner.process && learner.gate.admits(*message)) learner.process->deliver(message);
  }
}

void Simulation::run() {
  const int num_learners = static_cast<int>(learners_.size());
  if (num_learners > 1) observer_.count("second learners on the group");
  for (int index = 0; index < num_learners; ++index) {
    schedule_.at(TimePoint{}, [this, index] { start_learner(index); });
  }
  for (int slot = 0; slot < static_cast<int>(scenario_.workers.size()); ++slot) {
    const TimePoint joins = scenario_.workers[static_cast<std::size_t>(slot)].joins;
    if (joins > TimePoint{}) observer_.count("workers joining late");
    schedule_.at(joins, [this, slot] { start_worker(slot); });
  }
  for (int index = 0; index < scenario_.num_relays; ++index) {
    schedule_.at(TimePoint{}, [this, index] { start_relay(index); });
  }
  for (const Incident& incident : scenario_.incidents) {
    schedule_.at(incident.time, [this, &incident] { strike(incident); });
  }
  try {
    advance_to_the_end();
  } catch (const BrokenCheck& broken) {
    observer_.require(false, broken.what());
  }
}

void Simulation::advance_to_the_end() {
  const TimePoint end = scenario_.faults_end + patience();
  const std::int64_t actions_max = kActionsMax + kActionsPerWorkerMax * std::ssize(workers_);
  std::int64_t num_actions = 0;
  while (num_done_ < static_cast<int>(learners_.size()) && !observer_.broken()) {
    if (schedule_.advance(end) && ++num_actions < actions_max) continue;
    observer_.require(false, "no end although faults have stopped");
  }
}

void Simulation::start_learner(int index) {
  LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  SimulatedLearner::Surroundings surroundings;
  slot.gate = gate(Keys::kLearner);
  surroundings.send = [this, &slot](const Node::MessagePointer& plain) {
    const Node::MessagePointer message = slot.gate.seal(plain);
    network_.note_published(message);
    for (int worker = 0; worker < static_cast<int>(workers_.size()); ++worker) {
      if (scenario_.workers[static_cast<std::size_t>(worker)].relay >= 0) continue;
      network_.send(worker, Network::Direction::kToWorker, message);
    }
    for (int relay = 0; relay < scenario_.num_relays; ++relay) {
      network_.send(link_of_relay(relay), Network::Direction::kToWorker, message);
    }
  };
  surroundings.crashed = [this, index] {
    observer_.count("learner crashes");
    schedule_.after(Duration{}, [this, index] { restart_learner(index); });
  };
  surroundings.ended = [this, index] {
    schedule_.after(Duration{}, [this, index] { learner_ended(index); });
  };
  slot.process =
      std::make_unique<SimulatedLearner>(scenario_, index, schedule_, observer_, slot.disk,
                                         slot.generation++, std::move(surroundings));
  slot.process->start();
}

void Simulation::restart_learner(int index) {
  LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  slot.process.reset();
  if (slot.dies) {
    ++num_done_;
    return;
  }
  schedule_.after(slot.absence, [this, index] { start_learner(index); });
}

void Simulation::learner_ended(int index) {
  LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  if (!slot.process) return;
  if (slot.process->core().outcome() != learner::LearnerCore::Outcome::kDone)
    return restart_learner(index);
  check_outcome(index);
  slot.process.reset();
  ++num_done_;
}

void Simulation::start_worker(int slot) {
  const auto place = static_cast<std::size_t>(slot);
  const int generation = generations_[place]++;
  gates_[place] = gate(Keys::kWorker, slot);
  workers_[place] = std::make_unique<SimulatedWorker>(
      scenario_, schedule_, observer_, slot, generation,
      SimulatedWorker::Surroundings{[this, slot, place](const Node::MessagePointer& plain) {
                                      const auto message = gates_[place].seal(plain);
                                      network_.note_published(message);
                                      network_.send(slot, Network::Direction::kToLearner, message);
                                    },
                                    [this, slot, place, generation] {
                                      schedule_.after(Duration{}, [this, slot, place, generation] {
                                        if (generations_[place] == generation + 1)
                                          remove_worker(slot, absence_[place]);
                                      });
                                    }});
  if (stuck_[place]) workers_[place]->stick();
  workers_[place]->start();
}

void Simulation::remove_worker(int slot, Duration rejoins_after) {
  auto& worker = workers_[static_cast<std::size_t>(slot)];
  if (!worker) return;
  worker.reset();
  schedule_.after(rejoins_after, [this, slot] { start_worker(slot); });
}

void Simulation::start_relay(int index) {
  RelaySlot& slot = relays_[static_cast<std::size_t>(index)];
  const int generation = slot.generation++;
  SimulatedRelay::Surroundings surroundings;
  slot.gate_above = gate(Keys::kWorker, kHostOfRelays + index);
  slot.gate_below = gate(Keys::kLearner);
  surroundings.send_above = [this, index, &slot](const Node::MessagePointer& plain) {
    const Node::MessagePointer message = slot.gate_above.seal(plain);
    network_.note_published(message);
    network_.send(link_of_relay(index), Network::Direction::kToLearner, message);
  };
  surroundings.send_below = [this, index, &slot](const Node::MessagePointer& plain) {
    const Node::MessagePointer message = slot.gate_below.seal(plain);
    network_.note_published(message);
    for (int worker = 0; worker < static_cast<int>(workers_.size()); ++worker) {
      if (scenario_.workers[static_cast<std::size_t>(worker)].relay != index) continue;
      network_.send(worker, Network::Direction::kToWorker, message);
    }
  };
  surroundings.exited = [this, index, generation] {
    schedule_.after(Duration{}, [this, index, generation] {
      const RelaySlot& left = relays_[static_cast<std::size_t>(index)];
      if (left.generation == generation + 1) remove_relay(index, left.absence);
    });
  };
  slot.process = std::make_unique<SimulatedRelay>(scenario_, schedule_, observer_, index,
                                                  generation, std::move(surroundings));
  slot.process->start();
}

void Simulation::remove_relay(int index, Duration rejoins_after) {
  RelaySlot& slot = relays_[static_cast<std::size_t>(index)];
  if (!slot.process) return;
  slot.process.reset();
  schedule_.after(rejoins_after, [this, index] { start_relay(index); });
}

void Simulation::strike_relay(const Incident& incident) {
  RelaySlot& slot = relays_[static_cast<std::size_t>(incident.slot)];
  if (!slot.process) return;
  if (incident.kind == Kind::kRelayStop) {
    observer_.count("relays stopped for a while");
    return slot.process->stop_until(schedule_.now() + incident.length);
  }
  if (incident.kind == Kind::kRelayCrash) {
    observer_.count("relay crashes");
    return remove_relay(incident.slot, incident.length);
  }
  observer_.count("relays drained");
  slot.absence = incident.length;
  slot.process->drain();
}

void Simulation::strike(const Incident& incident) {
  if (incident.befalls_relay()) return strike_relay(incident);
  incident.befalls_learner() ? strike_learner(incident) : strike_worker(incident);
}

void Simulation::strike_worker(const Incident& incident) {
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
      return worker->stop_for(incident.length);
    case Kind::kEvaluatorsKilled:
      if (worker) worker->kill_evaluators();
      return;
    case Kind::kEvaluatorsDying:
      if (worker) worker->kill_evaluators_until(end);
      return;
    case Kind::kWorkerDeaf:
      observer_.count("workers deaf for ever");
      return network_.deafen(incident.slot);
    case Kind::kEvaluatorsStuck:
      observer_.count("workers stuck for ever");
      stuck_[place] = true;
      if (worker) worker->stick();
      return;
    case Kind::kPlayback:
      observer_.count("recordings played");
      return network_.play_back(incident.speed);
    case Kind::kPartition:
      observer_.count("partitions");
      return network_.cut(incident.slot, end);
    case Kind::kRelayCrash:
    case Kind::kRelayDrain:
    case Kind::kRelayStop:
    case Kind::kLearnerDies:
    case Kind::kLearnerCrash:
    case Kind::kLearnerExit:
    case Kind::kLearnerStop:
      return;
  }
}

void Simulation::strike_learner(const Incident& incident) {
  LearnerSlot& slot = learners_[static_cast<std::size_t>(incident.slot)];
  if (!slot.process) return;
  if (incident.kind == Kind::kLearnerStop) {
    observer_.count("learner stopped for a while");
    return slot.process->stop_until(schedule_.now() + incident.length);
  }
  slot.absence = incident.length;
  if (incident.kind == Kind::kLearnerDies) {
    observer_.count("learners that never come back");
    slot.dies = true;
    return slot.process->crash_at_next_effect();
  }
  if (incident.kind == Kind::kLearnerCrash) return slot.process->crash_at_next_effect();
  observer_.count("learner asked to stop");
  slot.process->stop();
}

Duration Simulation::patience() const {
  // A roll-out that hangs takes three evaluators, each blocked for twice its limit and a second
  // after it has computed; four times as long is a lease that was lost together with its worker.
  const Duration hanging =
      5 * 3 * (scenario_.task.duration_max + 2 * scenario_.task.time_limit + seconds(1));
  // A roll-out that is held for ever is given to another worker after a second or four durations,
  // a deaf worker may have it for some leases.
  const bool lasting = std::any_of(
      scenario_.incidents.begin(), scenario_.incidents.end(), [](const Incident& incident) {
        return incident.kind == Kind::kEvaluatorsStuck || incident.kind == Kind::kWorkerDeaf;
      });
  const Duration held = lasting ? 3 * (seconds(1) + 4 * scenario_.task.duration_max) : Duration{};
  Duration sum = seconds(60);
  const VirtualTask task(scenario_.seed, scenario_.task);
  for (const Study& study : scenario_.studies) {
    for (int run = 0; run < study.num_runs(); ++run) {
      const int num_rollouts = condition_of(study, run).exploration.num_rollouts;
      const int first = learner::Run::final_number(study.final_evaluations);
      for (int number = first; number < num_rollouts; ++number) {
        const int num_trials = scenario_.task.discarding > 0 ? study.discards_max + 1 : 1;
        sum +=
            task.fate({run, number}) == Fate::kHangs
                ? hanging
                : num_trials * (4 * scenario_.task.duration_max + 2 * scenario_.network.delay_max +
                                std::chrono::milliseconds(20) + held);
      }
    }
  }
  // Two leases one behind the other, and two silences to be noticed.
  return scenario_.num_relays > 0 ? 2 * sum : sum;
}

void Simulation::check_outcome(int index) {
  const LearnerSlot& slot = learners_[static_cast<std::size_t>(index)];
  const Study& study = scenario_.studies[static_cast<std::size_t>(index)];
  const std::vector<RunRecord> records = slot.process->core().run_records();
  const std::optional<std::vector<JournalRecord>> journal = slot.disk.records();
  observer_.require(journal.has_value(), "the journal of a learner that has ended is not whole");
  if (!journal) return;
  const Ends ends = ends_of(study, *journal);
  if (ends.time_was_up) observer_.count("studies ended by their time");
  std::size_t expected = records.size() * (1 + static_cast<std::size_t>(study.final_evaluations));
  for (const RunRecord& run : records) expected += run.rollouts.size();
  observer_.require(ends.keys.size() == expected, "the journal has not each answer once");
  observer_.require(ends.num_results == expected, "the journal has an answer twice");
  for (const RunRecord& run : records) {
    const explore::ExplorationSettings& exploration = condition_of(study, run.run).exploration;
    const int num_drawn =
        ends.time_was_up
            ? std::min(exploration.num_rollouts,
                       ends.num_applied[static_cast<std::size_t>(run.run)] + exploration.in_flight)
            : exploration.num_rollouts;
    const bool is_given_up = num_with(run, RolloutStatus::kDiscarded) > 0;
    observer_.require(is_given_up ? run.rollouts.size() <= static_cast<std::size_t>(num_drawn)
                                  : run.rollouts.size() == static_cast<std::size_t>(num_drawn),
                      "a run has not exactly its roll-outs");
    observer_.require(std::none_of(run.rollouts.begin(), run.rollouts.end(),
                                   [](const auto& rollout) { return rollout.layer == 0; }),
                      "a roll-out has no result");
    observer_.require(run.start.has_value(), "a start policy is not evaluated");
    observer_.require(run.finals.size() == static_cast<std::size_t>(study.final_evaluations) &&
                          run.final_reward == mean_reward(run.finals),
                      "a run has no final evaluation");
    if (is_given_up) continue;
    if (!ends.time_was_up)
      observer_.require(exploration.convergence_slope < kAnySlope ||
                            static_cast<int>(run.switches.size()) == exploration.last_layer - 1,
                        "a run has not switched its layers");
    if (run.repetition == 0 || ends.time_was_up) continue;
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
  if (study.in_sequence) {
    compare(faultless_records(study, VirtualTask(scenario_.seed, scenario_.task), ends.num_applied),
            "the result is not that without faults");
  } else {
    compare(folded_records(study, *journal), "the fold of the journal is another result");
  }
}

}  // namespace treeroll::simulation
