#pragma once

#include "common/policy/tree/tree_controller.h"
#include "workers/tasks/task.h"
#include "workers/tasks/trace.h"

namespace treeroll {

/// The task's roll-out with the regression of a mixture.
inline Outcome evaluate(Task& task, const Gmm& policy, std::uint64_t seed) {
  TreeController controller(policy);
  return task.evaluate(controller, seed);
}

inline Outcome evaluate_traced(Task& task, const Gmm& policy, std::uint64_t seed, Trace& trace) {
  TreeController controller(policy);
  return task.evaluate_traced(controller, seed, trace);
}

}  // namespace treeroll
