#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "tests/simulation/network.h"
#include "tests/simulation/simulated_learner.h"
#include "tests/simulation/simulated_worker.h"

namespace treeroll::simulation {

/// One study from start to end under the faults of a scenario: a function of the scenario alone.
class Simulation {
 public:
  explicit Simulation(const Scenario& scenario);

  /// Until the study is done, a rule is broken, or nothing moves although the faults have stopped.
  void run();

  const Observer& observer() const { return observer_; }
  TimePoint end() const { return schedule_.now(); }

 private:
  void start_learner();
  void start_worker(int slot);
  void remove_worker(int slot, Duration rejoins_after);
  void learner_ended();
  void strike(const Incident& incident);
  /// Virtual time in which what is left when the faults stop must be done.
  Duration patience() const;
  void check_outcome();

  const Scenario& scenario_;
  Schedule schedule_;
  Observer observer_{schedule_};
  Network network_;
  Disk disk_;
  std::unique_ptr<SimulatedLearner> learner_;
  std::vector<std::unique_ptr<SimulatedWorker>> workers_;
  std::vector<int> generations_;   ///< of worker slots
  std::vector<Duration> absence_;  ///< how long a drained worker stays away
  int learner_generation_ = 0;
  Duration learner_absence_{};
  bool done_ = false;
};

/// What each run must come to in order "sequence": every roll-out drawn, evaluated and applied one
/// after the other, without a network.
std::vector<RunRecord> faultless_records(const Scenario& scenario);

}  // namespace treeroll::simulation
