#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "workers/core/evaluators.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// Which evaluator does what: starts and restarts them, has definitions checked and roll-outs
/// evaluated, watches over the time that takes, and says by whose fault one has ended. It appends
/// to the effects of the turn; time is the turn's.
///
///   pool.start(turn);
///   while (const auto idle = pool.idle_evaluator()) { ... check() or evaluate() ... }
///   for (const WorkEnd& end : pool.on(turn, event, definitions)) ...
///   pool.watch(turn);  // at pool.next_deadline()
class EvaluatorPool : public Evaluators {
 public:
  /// The settings must outlive the pool.
  explicit EvaluatorPool(const WorkerSettings& settings);

  void start(const Turn& turn) override;
  void drain() override { draining_ = true; }
  int count() const override { return static_cast<int>(evaluators_.size()); }
  std::optional<int> idle_evaluator() const override;
  void check(const Turn& turn, int index, const DefinitionName& name,
             const DefinitionShelf& definitions) override;
  void evaluate(const Turn& turn, int index, std::vector<Work> works,
                DefinitionShelf& definitions) override;
  void withdraw(const RolloutName& name) override;
  bool end_work(const Turn& turn, const RolloutName& name) override;
  std::vector<WorkEnd> on(const Turn& turn, const EvaluatorEvent& event,
                          DefinitionShelf& definitions) override;
  void watch(const Turn& turn) override;
  /// Or before.
  TimePoint next_deadline() const override { return look_at_; }
  void excuse(Duration delay) override;
  bool any_living() const override;
  bool in_trouble() const override;
  std::int64_t num_restarts() const override { return num_restarts_; }

 private:
  enum class State { kDown, kStarting, kIdle, kLoading, kRunning };
  struct Given {
    Work work;
    bool wanted = true;  ///< not withdrawn
    bool done = false;
  };
  struct Evaluator {
    State state = State::kDown;
    bool killed = false;       ///< its death is on its way
    bool dismissed = false;    ///< killed for work that nobody wants
    bool timed_out = false;    ///< killed for exceeding a time limit while loading or running
    bool runs_once = false;    ///< runs what is not repeatable
    std::int64_t job = 0;      ///< number of what it loads or, with those that follow, runs
    TimePoint since;           ///< of the job or the start
    Duration time_limit{};     ///< of the job, CPU time
    TimePoint busy_at;         ///< last seen to have burnt CPU time on the job, or its begin
    Duration busy_cpu_time{};  ///< what it had burnt by then
    /// Start time-out, CPU time check, restart when down; killed: the end of its grace.
    std::optional<TimePoint> look_at;
    std::vector<Given> given;
    std::int64_t num_done = 0;              ///< of these
    std::optional<DefinitionName> loading;  ///< for what is given, else to check it
    std::set<DefinitionName> known;
    std::int64_t num_evicted_seen = 0;
    /// In a row since its last result, not the fault of a roll-out or definition.
    int num_bare_deaths = 0;

    bool is_wanted() const { return std::ranges::any_of(given, &Given::wanted); }
  };
  using Ends = std::vector<WorkEnd>;

  // evaluator_pool.cc: what they are given, and what comes of it.
  Ends on(const Turn& turn, const EvaluatorReady& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const DefinitionLoaded& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const RolloutEvaluated& event, DefinitionShelf& definitions);
  void continue_work(const Turn& turn, int index, DefinitionShelf& definitions);
  void load(const Turn& turn, int index, const DefinitionName& name,
            const DefinitionShelf& definitions);
  void release(Evaluator& evaluator);

  // evaluator_pool_lives.cc: how they start, how long they may take, how they end.
  Ends on(const Turn& turn, const CpuTimeMeasured& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const EvaluatorDied& event, DefinitionShelf& definitions);
  WorkEnd interrupted(const Turn& turn, const EvaluatorDied& event, const Work& work,
                      bool charged) const;
  void start(const Turn& turn, int index);
  void kill(const Turn& turn, int index);
  void begin_job(const Turn& turn, Evaluator& evaluator, State state, Duration limit);
  void watch(const Turn& turn, int index);
  void look_at(Evaluator& evaluator, TimePoint time);

  Evaluator& at(int index) { return evaluators_.at(static_cast<std::size_t>(index)); }
  int index_of(const Evaluator& evaluator) const {
    return static_cast<int>(&evaluator - evaluators_.data());
  }

  const WorkerSettings& settings_;
  std::vector<Evaluator> evaluators_;
  std::set<int> idle_;  // those that may be given something
  /// Not after the first look to come. Who is done takes his look away and leaves this as it is,
  /// so that no result costs a walk over all evaluators.
  TimePoint look_at_ = TimePoint::max();
  std::int64_t next_job_ = 1;
  std::int64_t num_restarts_ = 0;
  bool draining_ = false;
};

}  // namespace treeroll::worker
