#pragma once

#include "common/policy/policy_registry.h"
#include "common/policy/tree/tree_policy.h"

namespace treeroll {

/// What a study begins with, known to be a tree.
inline const TreePolicy& tree_policy(const Policy& policy) {
  return dynamic_cast<const TreePolicy&>(policy);
}
inline const TreePolicy& tree_policy(const StartPolicy& start) {
  return tree_policy(*start.policy);
}
inline const TreeModel& tree_of(const StartPolicy& start) { return tree_policy(start).tree(); }

}  // namespace treeroll
