#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tests/simulation/dice.h"
#include "tests/simulation/node.h"
#include "tests/simulation/observer.h"
#include "tests/simulation/scenario.h"
#include "workers/core/worker_core.h"

namespace treeroll::simulation {

/// One incarnation of a worker daemon: the shipped core, and evaluator processes that are virtual.
class SimulatedWorker : public Node {
 public:
  struct Surroundings {
    std::function<void(MessagePointer)> send;
    std::function<void()> exited;
  };

  SimulatedWorker(const Scenario& scenario, Schedule& schedule, Observer& observer, int slot,
                  int generation, Surroundings surroundings);

  void start() { step(worker::Started{}); }
  void drain();
  /// SIGSTOP: that it hears nothing for so long is nobody's silence.
  void stop_for(Duration length);
  void kill_evaluators();
  /// Those that live, and until then each new one, be it at its start or at its first roll-out.
  void kill_evaluators_until(TimePoint end);
  /// No roll-out that is begun from now on ends.
  void stick();

 private:
  struct Evaluator {
    bool up = false;
    bool ready = false;
    std::int64_t incarnation = 0;
    std::int64_t job = 0;  ///< 0: idle
    TimePoint since;
    Duration cpu_time_max{};  ///< the job burns no more
    bool lost = false;        ///< of these one crashes or hangs: none after it is begun
    Duration ahead{};         ///< what those before take
    std::set<worker::DefinitionName> known;
    int num_killed = 0;  ///< predecessors killed by others in a row, since the last result
  };

  void on_inbox(std::vector<MessagePointer> messages) override;
  void on_timer() override;

  /// The event and the end of the round.
  void step(const worker::Event& event);
  void take(const worker::Event& event);
  /// Later, unless the evaluator has died meanwhile.
  void from_evaluator(int index, Duration delay,
                      const std::function<worker::Event(Evaluator&)>& what);
  void die(int index, Duration delay, worker::Death death, int code);

  void perform(const worker::SendMessage& effect);
  void perform(const worker::StartEvaluator& effect);
  void perform(const worker::EndEvaluator& effect);
  void perform(const worker::KillEvaluator& effect);
  void perform(const worker::LoadDefinition& effect);
  void perform(const worker::ForgetDefinition& effect);
  void perform(const worker::RunRollouts& effect);
  void evaluate(int index, std::int64_t job, const protocol::RolloutRequest& request, bool is_last);
  void perform(const worker::AskCpuTime& effect);
  void perform(const LogLine&) {}
  void perform(const worker::Exit& effect);

  void check_room(const protocol::WorkerStatus& status);
  void check_learners(const protocol::WorkerStatus& status);
  void note_answers(const protocol::RewardBatch& batch);
  void begin(Evaluator& evaluator, std::int64_t job);
  Outcome said(const protocol::RolloutRequest& request, Outcome outcome);

  const Scenario& scenario_;
  Observer& observer_;
  Surroundings surroundings_;
  Dice dice_;
  worker::WorkerSettings settings_;
  worker::WorkerCore core_;
  VirtualTask task_;
  std::vector<Evaluator> evaluators_;
  std::map<protocol::RolloutKey, int> num_flaky_deaths_;
  TimePoint killed_until_{};
  bool draining_ = false;
  bool stuck_ = false;
  bool is_liar_ = false;
  std::map<protocol::LearnerId, TimePoint> heard_;  ///< its learners
};

}  // namespace treeroll::simulation
