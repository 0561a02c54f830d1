#include "learner/explore/update_rule.h"

#include "learner/explore/perturbation.h"

namespace treeroll::explore {

Eigen::VectorXd UpdateRule::next_normal_numbers(RandomStream stream) {
  return normal_numbers(distribution().mean.size(), stream);
}

}  // namespace treeroll::explore
