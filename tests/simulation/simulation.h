#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/simulation/gate.h"
#include "tests/simulation/network.h"
#include "tests/simulation/simulated_learner.h"
#include "tests/simulation/simulated_relay.h"
#include "tests/simulation/simulated_worker.h"

namespace treeroll::simulation {

/// A scenario's studies from start to end under the faults of a scenario: a function of the
/// scenario alone.
class Simulation {
 public:
  explicit Simulation(const Scenario& scenario);

  /// Until each study is done, a rule is broken, or nothing moves although the faults have stopped.
  void run();

  const Observer& observer() const { return observer_; }
  TimePoint end() const { return schedule_.now(); }
  const Network& network() const { return network_; }

 private:
  void advance_to_the_end();
  void start_learner(int index);
  Gate gate(Keys keys, int host = 0) const {
    return {scenario_.has_keys ? keys : Keys::kNone, host};
  }
  void deliver(int link, Network::Direction direction, const Node::MessagePointer& message);
  void start_worker(int slot);
  void start_relay(int index);
  void remove_relay(int index, Duration rejoins_after);
  void remove_worker(int slot, Duration rejoins_after);
  void restart_learner(int index);
  void learner_ended(int index);
  /// The link between a relay and the learners; those of workers have the workers' numbers.
  int link_of_relay(int index) const { return static_cast<int>(workers_.size()) + index; }
  /// Virtual time in which what is left when the faults stop must be done.
  Duration patience() const;

  // simulation_incidents.cc: what befalls whom.
  void strike(const Incident& incident);
  void strike_worker(const Incident& incident);
  void strike_relay(const Incident& incident);
  void strike_learner(const Incident& incident);

  // simulation_outcome.cc: what a study must have come to.
  void check_outcome(int index);
  void check_rechecks(int index, const std::vector<JournalRecord>& journal);
  bool without_liars(const Study& study, const std::vector<JournalRecord>& journal);

  const Scenario& scenario_;
  Schedule schedule_;
  Observer observer_{schedule_};
  Network network_;
  struct LearnerSlot {
    Disk disk;
    std::unique_ptr<SimulatedLearner> process;
    Gate gate;
    int generation = 0;
    Duration absence{};  ///< how long it stays away once gone
    bool dies = false;   ///< once gone it stays away
  };
  std::vector<LearnerSlot> learners_;
  struct RelaySlot {
    std::unique_ptr<SimulatedRelay> process;
    Gate gate_above;
    Gate gate_below;
    int generation = 0;
    Duration absence{};  ///< how long a drained one stays away
  };
  std::vector<RelaySlot> relays_;
  std::vector<std::unique_ptr<SimulatedWorker>> workers_;
  std::vector<Gate> gates_;        ///< of worker slots
  std::vector<int> generations_;   ///< of worker slots
  std::vector<bool> stuck_;        ///< worker slots where no roll-out ends
  std::vector<Duration> absence_;  ///< how long a drained worker stays away
  int num_done_ = 0;
};

}  // namespace treeroll::simulation
