#pragma once

#include "common/policy/tree/tree_controller.h"
#include "workers/tasks/task.h"
#include "workers/tasks/trace.h"

namespace treeroll {

/// One line over time: acceleration offset + slope t.
inline Gmm line(double offset, double slope) {
  Eigen::Matrix2d covariance;
  covariance << 1, slope, slope, slope * slope + .1;
  return Gmm(1, {{.prior = 1, .mean = Eigen::Vector2d(0, offset), .covariance = covariance}});
}

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
