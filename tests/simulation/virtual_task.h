#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/outcome.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"

namespace treeroll::simulation {

/// How the virtual task behaves: rates are of roll-outs and hold for them wherever they run.
struct TaskBehaviour {
  Duration duration_min{};
  Duration duration_max{};
  double crashing = 0;  ///< end their evaluator by a fatal signal, whenever they run
  double hanging = 0;   ///< run past the task's time limit
  double diverging = 0;
  double flaky = 0;       ///< end two evaluators of a worker, then succeed
  double discarding = 0;  ///< of trials: void, whichever worker makes them
  Duration time_limit = std::chrono::milliseconds(400);
};

extern const char* const kTaskContent;
/// @param names_signals  as workers of this version do; those before it name none
std::string task_description(const TaskBehaviour& behaviour, bool names_signals);

enum class Fate { kFine, kCrashes, kHangs, kDiverges, kFlaky };

/// A task whose reward is a smooth bump of theta, the same from every worker.
class VirtualTask {
 public:
  VirtualTask(std::uint64_t seed, TaskBehaviour behaviour) : seed_(seed), behaviour_(behaviour) {}

  Fate fate(protocol::RolloutKey key) const;
  /// What every worker must in the end answer to a trial.
  Outcome outcome(protocol::RolloutKey key, std::int64_t task_seed,
                  const std::vector<double>& theta) const;

  const TaskBehaviour& behaviour() const { return behaviour_; }

 private:
  std::uint64_t seed_;
  TaskBehaviour behaviour_;
};

}  // namespace treeroll::simulation
