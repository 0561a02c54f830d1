#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <variant>
#include <vector>

#include "common/base/outcome.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "workers/core/definition_shelf.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// A roll-out given to the pool.
struct Work {
  RolloutName name;
  protocol::RolloutRequest request;
  Mishaps mishaps;  ///< so far
};

// What becomes of it.

struct WorkAnswered {
  RolloutName name;
  Outcome outcome;
  std::int64_t duration_ns = 0;
};
/// Its evaluator has ended: to be given again. Alone if others were beside it, so that it is found
/// whose fault it was.
struct WorkPutBack {
  RolloutName name;
  Mishaps mishaps;
};
/// It cannot be evaluated here.
struct WorkGivenUp {
  RolloutName name;
};
using WorkEnd = std::variant<WorkAnswered, WorkPutBack, WorkGivenUp>;

/// Which evaluator does what: starts and restarts them, has definitions checked and roll-outs
/// evaluated, watches over the time that takes, and says by whose fault one has ended. It appends
/// to the effects of the turn; time is the turn's.
///
///   pool.start(turn);
///   while (const auto idle = pool.idle_evaluator()) { ... check() or evaluate() ... }
///   for (const WorkEnd& end : pool.on(turn, event, definitions)) ...
///   pool.watch(turn);  // at pool.next_deadline()
class EvaluatorPool {
 public:
  /// The settings must outlive the pool.
  explicit EvaluatorPool(const WorkerSettings& settings);

  /// All evaluators, once.
  void start(const Turn& turn);
  /// From now on nobody is started again, and no work is given up.
  void drain() { draining_ = true; }

  /// The first one that waits for something to do.
  std::optional<int> idle_evaluator() const;
  /// Precondition of both: the evaluator is idle. The definition is one take_unchecked() gave;
  /// those of the work are accepted and stay on the shelf as long as it is wanted. Works given
  /// together have the same ones, and a time limit together: the sum.
  void check(const Turn& turn, int index, const DefinitionName& name,
             const DefinitionShelf& definitions);
  void evaluate(const Turn& turn, int index, std::vector<Work> works, DefinitionShelf& definitions);
  /// Nobody wants to know any more what becomes of this work, if it is here. Its evaluator finishes
  /// what it does.
  void withdraw(const RolloutName& name);
  /// The same, and its evaluator is ended: the work may take long.
  void end_work(const Turn& turn, const RolloutName& name);

  /// Tells `definitions` what has come of a check. Returns how roll-outs' work has ended that has
  /// and was wanted.
  std::vector<WorkEnd> on(const Turn& turn, const EvaluatorEvent& event,
                          DefinitionShelf& definitions);
  /// Acts on the deadlines that have come.
  void watch(const Turn& turn);
  /// When watch() is due, or before; TimePoint::max() if no evaluator needs it.
  TimePoint next_deadline() const { return look_at_; }
  /// A time that counts against none of them: they were stopped, or this process was.
  void excuse(Duration delay);

  /// Whether any has started and lives.
  bool any_living() const;
  /// Every one dies again and again: it is the host, not what it holds.
  bool in_trouble() const;
  std::int64_t num_restarts() const { return num_restarts_; }

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
    std::int64_t job = 0;      ///< number of what it loads or, with those that follow, runs
    TimePoint since;           ///< of the job or the start
    Duration time_limit{};     ///< of the job, CPU time
    TimePoint busy_at;         ///< last seen to have burnt CPU time on the job, or its begin
    Duration busy_cpu_time{};  ///< what it had burnt by then
    std::optional<TimePoint> look_at;  ///< start time-out, CPU time check, or restart when down
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

  Ends on(const Turn& turn, const EvaluatorReady& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const DefinitionLoaded& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const RolloutEvaluated& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const CpuTimeMeasured& event, DefinitionShelf& definitions);
  Ends on(const Turn& turn, const EvaluatorDied& event, DefinitionShelf& definitions);
  WorkEnd interrupted(const Turn& turn, const Evaluator& evaluator, const Work& work,
                      bool charged) const;
  Evaluator& at(int index) { return evaluators_.at(static_cast<std::size_t>(index)); }
  void start(const Turn& turn, int index);
  void kill(const Turn& turn, int index);
  void watch(const Turn& turn, int index);
  void continue_work(const Turn& turn, int index, DefinitionShelf& definitions);
  void load(const Turn& turn, int index, const DefinitionName& name,
            const DefinitionShelf& definitions);
  void begin_job(const Turn& turn, Evaluator& evaluator, State state, Duration limit);
  void release(Evaluator& evaluator);
  void look_at(Evaluator& evaluator, TimePoint time);
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
