#include "common/policy/tree/tree_controller.h"

namespace treeroll {

void TreeController::act(std::span<const double> input, std::span<double> output) {
  gmr_.regress(input, work_, output);
}

void TreeController::act_all(std::span<const double> inputs, std::span<double> outputs) {
  gmr_.regress_all(inputs, work_, outputs);
}

}  // namespace treeroll
