#pragma once

#include <functional>
#include <map>
#include <set>
#include <vector>

#include "learner/core/learner_core.h"
#include "tests/simulation/dice.h"
#include "tests/simulation/node.h"
#include "tests/simulation/observer.h"
#include "tests/simulation/scenario.h"

namespace treeroll::simulation {

/// What outlives a learner: the journal. A crash may lose what was not yet synced.
struct Disk {
  std::vector<AcceptedResult> journal;
  std::size_t num_synced = 0;
};

LearnerSettings learner_settings(const Scenario& scenario, protocol::LearnerId id);

/// One incarnation of the learner daemon: the shipped core, its effects carried out in their order
/// upon a virtual disk and network. Checks the rules that hold at every step.
class SimulatedLearner : public Node {
 public:
  struct Surroundings {
    std::function<void(MessagePointer)> send;
    std::function<void()> crashed;
    std::function<void()> ended;  ///< done or stopped, and all on disk
  };

  SimulatedLearner(const Scenario& scenario, Schedule& schedule, Observer& observer, Disk& disk,
                   int generation, Surroundings surroundings);

  void start();
  void stop();
  /// SIGKILL in the midst of the next effects: some are carried out, the others are not.
  void crash_at_next_effect() { crash_is_due_ = true; }

  const LearnerCore& core() const { return core_; }

 private:
  void on_inbox(std::vector<MessagePointer> messages) override;
  void on_timer() override;

  void step(const LearnerEvent& event);
  void take(const LearnerEvent& event);
  void carry_out(const LearnerEffects& effects);
  void write(const AcceptedResult& result);
  void send(const protocol::Message& message);
  void sync();
  void crash();

  void note_answered(protocol::RolloutKey key);
  void check_batch(const protocol::RolloutBatch& batch);
  void check_counters();

  /// What a roll-out that is asked for must come to.
  struct Expected {
    std::int64_t content = 0;
    double reward = 0;
  };

  const Scenario& scenario_;
  Observer& observer_;
  Disk& disk_;
  Surroundings surroundings_;
  Dice dice_;
  protocol::LearnerId id_;
  VirtualTask task_;
  LearnerCore core_;
  bool crash_is_due_ = false;
  bool dead_ = false;
  bool ended_ = false;
  bool sync_is_due_ = false;
  std::int64_t last_sequence_ = 0;
  std::int64_t num_reissued_ = 0;
  std::int64_t num_failed_ = 0;  ///< applied and failed, as the journal has them
  std::map<protocol::RolloutKey, Expected> expected_;
  std::set<protocol::RolloutKey> answered_;
  std::set<protocol::RolloutKey> synced_;
  std::vector<int> num_applied_;  ///< by run, as the journal has it
};

}  // namespace treeroll::simulation
