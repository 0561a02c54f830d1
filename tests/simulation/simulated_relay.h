#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "tests/simulation/dice.h"
#include "tests/simulation/node.h"
#include "tests/simulation/observer.h"
#include "tests/simulation/scenario.h"
#include "workers/relay/relay_core.h"

namespace treeroll::simulation {

/// One incarnation of a relay daemon: the shipped core between two networks.
class SimulatedRelay : public Node {
 public:
  struct Surroundings {
    std::function<void(MessagePointer)> send_above;
    std::function<void(MessagePointer)> send_below;
    std::function<void()> exited;
  };

  SimulatedRelay(const Scenario& scenario, Schedule& schedule, Observer& observer, int index,
                 int generation, Surroundings surroundings);

  void start() { step(relay::Started{}); }
  void drain();

 private:
  void on_inbox(std::vector<MessagePointer> messages) override;
  void on_timer() override { step(relay::TimerFired{}); }

  void step(const relay::Event& event);
  void take(const relay::Event& event);
  void perform(const relay::SendAbove& effect);
  void perform(const relay::SendBelow& effect);
  void perform(const LogLine&) {}
  void perform(const relay::Exit& effect);
  void note_answers(const protocol::RewardBatch& batch);
  void check_class(const protocol::WorkerStatus& status);

  const Scenario& scenario_;
  Observer& observer_;
  Surroundings surroundings_;
  Dice dice_;
  relay::RelaySettings settings_;
  relay::RelayCore core_;
  bool draining_ = false;
};

}  // namespace treeroll::simulation
