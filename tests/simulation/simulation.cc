#include "tests/simulation/simulation.h"

#include <algorithm>
#include <utility>

#include "tests/simulation/broken_check.h"

namespace treeroll::simulation {
namespace {

using std::chrono::seconds;

/// More actions than any scenario takes: what goes past it goes round in circles.
constexpr std::int64_t kActionsMax = 5'000'000;
constexpr std::int64_t kActionsPerWorkerMax = 100'000;

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

Duration Simulation::patience() const {
  // A roll-out that hangs takes three evaluators, each blocked for twice its limit and a second
  // after it has computed; four times as long is a lease that was lost together with its worker.
  const Duration hanging =
      5 * 3 * (scenario_.task.duration_max + 2 * scenario_.task.time_limit + seconds(1));
  // A roll-out that is held for ever is given to another worker after a second or four durations,
  // a deaf worker may have it for some leases.
  const bool lasting = std::any_of(scenario_.incidents.begin(), scenario_.incidents.end(),
                                   [](const Incident& incident) {
                                     return incident.kind == Incident::Kind::kEvaluatorsStuck ||
                                            incident.kind == Incident::Kind::kWorkerDeaf;
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
        const bool is_run_again = learner::is_rechecked(study, run % study.repetitions, number);
        sum += (is_run_again ? 2 : 1) * (task.fate({run, number}) == Fate::kHangs
                                             ? hanging
                                             : num_trials * (4 * scenario_.task.duration_max +
                                                             2 * scenario_.network.delay_max +
                                                             std::chrono::milliseconds(20) + held));
      }
    }
  }
  // Two leases one behind the other, and two silences to be noticed.
  return scenario_.num_relays > 0 ? 2 * sum : sum;
}

}  // namespace treeroll::simulation
