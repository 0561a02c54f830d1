#pragma once

#include <memory>
#include <string>
#include <vector>

#include "learner/core/study.h"
#include "workers/tasks/task.h"

namespace treeroll::benchmarks {

/// A study of deploy/studies.
/// @param name       "swing_up"
/// @param overrides  as --set of the learner takes them
Study shipped_study(const std::string& name, const std::vector<std::string>& overrides = {});

/// The study of the comparison with other services.
Study cluster_study(const std::vector<std::string>& overrides = {});

/// The task of a condition, as an evaluator makes it.
std::unique_ptr<Task> task_of(const Condition& condition);

/// Thetas about that of a policy, each another one: nothing is computed once for all of them.
std::vector<Eigen::VectorXd> thetas_about(const Policy& policy, int number);

}  // namespace treeroll::benchmarks
