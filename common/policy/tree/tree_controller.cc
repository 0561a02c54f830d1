#include "common/policy/tree/tree_controller.h"

namespace treeroll {

void TreeController::act(std::span<const double> input, std::span<double> output) {
  gmr_.regress(input, work_, output);
}

}  // namespace treeroll
