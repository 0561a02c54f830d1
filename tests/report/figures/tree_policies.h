#pragma once

#include <memory>
#include <utility>

#include "common/policy/tree/tree_policy.h"

namespace treeroll {

inline PolicyPtr as_policy(TreeModel tree) {
  return std::make_shared<TreePolicy>(std::move(tree), 1, ThetaLayout::kMeansCholesky);
}

}  // namespace treeroll
