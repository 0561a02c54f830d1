#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "learner/core/carry_out.h"
#include "learner/core/learner_core.h"
#include "tests/simulation/dice.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/node.h"
#include "tests/simulation/observer.h"
#include "tests/simulation/scenario.h"

namespace treeroll::simulation {

/// One incarnation of a learner daemon: the shipped core, its effects carried out by the shipped
/// code upon a virtual disk and network. Checks the rules that hold at every step.
class SimulatedLearner : public Node, private learner::EffectHandler {
 public:
  struct Surroundings {
    std::function<void(MessagePointer)> send;
    std::function<void()> crashed;
    std::function<void()> ended;  ///< done or stopped, and all on disk
  };

  /// @param index  of its study in the scenario
  SimulatedLearner(const Scenario& scenario, int index, Schedule& schedule, Observer& observer,
                   Disk& disk, int generation, Surroundings surroundings);

  void start();
  void stop();
  /// SIGKILL in the midst of the next effects: some are carried out, the others are not.
  void crash_at_next_effect() { crash_is_due_ = true; }

  const learner::LearnerCore& core() const { return core_; }

 private:
  struct Crashed {};

  void on_inbox(std::vector<MessagePointer> messages) override;
  void on_timer() override;

  void step(const learner::Event& event);
  void take(const learner::Event& event);
  void do_all(const learner::Effects& effects);
  void crash_if_due();
  void crash();
  void write();
  void plan_sync();
  void begin_sync();
  void end_sync();

  void append(const AcceptedResult& result) override;
  void append(const SecondAnswer& answer) override;
  void append(const KnownWorker& worker) override;
  void append(const TaskSignals& signals) override;
  void append(const LearningTime& time) override;
  void flush() override;
  void send(const protocol::Message& message) override;
  void log(const LogLine&) override {}

  void recover(const JournalRecord& record);
  void note_answered(const AcceptedResult& result);
  void check_answer(const AcceptedResult& result);
  void check_outvoted();

  // simulated_learner_rules.cc: what must hold at every step.
  /// Results that are not on stable storage.
  std::int64_t lag() const {
    return static_cast<std::int64_t>(unwritten_.size() + unsynced_.size() + syncing_.size());
  }
  bool is_given_up(int run) const;
  void note_time(const LearningTime& time);
  void check_ends(protocol::RolloutKey key);
  std::vector<double> theta_of(const protocol::RolloutRequest& request);
  void check_again(const protocol::RolloutRequest& request);
  void check_batch(const protocol::RolloutBatch& batch);
  void check_told(const protocol::Message& message);
  void check_counters();
  bool waits_for_a_switch() const;
  bool has_described(protocol::WorkerId id) const;
  void hear(const protocol::Message& message);
  void check_lost_requests(const protocol::WorkerStatus& status);
  void check_leases_of_the_silent();

  /// What a roll-out that is asked for must come to.
  struct Expected {
    std::int64_t content = 0;
    Outcome outcome;  ///< but for the reason
  };
  /// What this learner has read of a worker.
  struct Heard {
    /// Of results: all up to `last`, and those past a gap.
    struct Indices {
      std::int64_t last = 0;
      std::set<std::int64_t> past_gap;
      void take(const protocol::RewardBatch& batch, bool with_results);
    };
    TimePoint time;
    Indices arrived;
    Indices surely_read;  ///< not those that arrived while the journal lagged
  };

  const Scenario& scenario_;
  const Study& study_;
  Observer& observer_;
  Disk& disk_;
  Surroundings surroundings_;
  Dice dice_;
  protocol::LearnerId id_;
  VirtualTask task_;
  learner::LearnerCore core_;
  bool crash_is_due_ = false;
  int effects_until_crash_ = -1;  ///< below 0: none
  bool dead_ = false;
  bool ended_ = false;
  bool is_sync_planned_ = false;  ///< or under way
  bool is_unsynced_ = false;      ///< something that no sync has begun with
  std::int64_t last_sequence_ = 0;
  std::int64_t num_reissued_ = 0;
  std::int64_t num_unasked_ = 0;
  std::int64_t num_failed_ = 0;  ///< applied and failed, as the journal has them
  std::map<protocol::RolloutKey, Expected> expected_;
  std::set<protocol::RolloutKey> open_;               ///< asked for and not answered
  std::vector<AcceptedResult> unwritten_;             ///< appended, in this process alone
  std::set<Observer::Question> accepted_;             ///< appended
  std::map<protocol::RolloutKey, Outcome> answered_;  ///< appended, but for trials made again
  std::map<protocol::RolloutKey, int> num_discards_;  ///< appended
  std::map<protocol::RolloutKey, std::set<protocol::WorkerId>> answered_by_;  ///< appended
  std::vector<Observer::Question> unsynced_;  ///< written, not synced
  std::vector<Observer::Question> syncing_;   ///< what the sync under way has
  std::set<Observer::Question> synced_;
  std::vector<int> num_applied_;  ///< by run, as the journal has it
  TimePoint started_at_;
  Duration learnt_before_{};  ///< by earlier incarnations, as the journal has it
  bool time_is_unwritten_ = false;
  std::optional<std::vector<int>> ends_;  ///< num_applied_ when the journal said the time is up
  std::map<protocol::WorkerId, Heard> heard_;
  std::map<protocol::WorkerId, std::int64_t> greeted_;  ///< in the batch of this sequence
  std::set<protocol::WorkerId> hearing_;                ///< have said that they had read that
};

}  // namespace treeroll::simulation
