#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "common/base/outcome.h"
#include "common/base/time.h"
#include "workers/core/definition_shelf.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_events.h"

namespace treeroll::worker {

/// A roll-out given to evaluators.
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

/// Who evaluates for a worker: an EvaluatorPool of processes here, or a relay's workers. Appends to
/// the effects of the turn; time is the turn's.
class Evaluators {
 public:
  Evaluators() = default;
  virtual ~Evaluators() = default;
  Evaluators(const Evaluators&) = delete;
  Evaluators& operator=(const Evaluators&) = delete;

  /// All of them, once.
  virtual void start(const Turn& turn) = 0;
  /// From now on nobody is started again, and no work is given up.
  virtual void drain() = 0;

  /// How many there are, whether they live or not.
  virtual int count() const = 0;
  /// The first one that waits for something to do.
  virtual std::optional<int> idle_evaluator() const = 0;
  /// Precondition of both: the evaluator is idle. The definition is one take_unchecked() gave;
  /// those of the work are accepted and stay on the shelf as long as it is wanted. Works given
  /// together have one task, and a time limit together: the sum.
  virtual void check(const Turn& turn, int index, const DefinitionName& name,
                     const DefinitionShelf& definitions) = 0;
  virtual void evaluate(const Turn& turn, int index, std::vector<Work> works,
                        DefinitionShelf& definitions) = 0;
  /// Nobody wants to know any more what becomes of this work, if it is here. Its evaluator finishes
  /// what it does.
  virtual void withdraw(const RolloutName& name) = 0;
  /// The same, and its evaluator is ended: the work may take long. What runs and is not repeatable
  /// is left alone: it may be a robot in motion. @return false if it is
  virtual bool end_work(const Turn& turn, const RolloutName& name) = 0;

  /// Tells `definitions` what has come of a check. Returns how roll-outs' work has ended that has
  /// and was wanted.
  virtual std::vector<WorkEnd> on(const Turn& turn, const EvaluatorEvent& event,
                                  DefinitionShelf& definitions) = 0;
  /// Acts on the deadlines that have come.
  virtual void watch(const Turn& turn) = 0;
  /// When watch() is due; TimePoint::max() if no evaluator needs it.
  virtual TimePoint next_deadline() const = 0;
  /// A time that counts against none of them: they were stopped, or this process was.
  virtual void excuse(Duration delay) = 0;

  /// Whether any has started and lives.
  virtual bool any_living() const = 0;
  /// Every one dies again and again: it is the host, not what it holds.
  virtual bool in_trouble() const = 0;
  virtual std::int64_t num_restarts() const = 0;
};

}  // namespace treeroll::worker
