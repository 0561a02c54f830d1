#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

using Kind = Incident::Kind;

}  // namespace

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

}  // namespace treeroll::simulation
