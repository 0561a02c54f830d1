#include "common/mixture/gmr_lanes.h"

#include "common/numbers/lanes.h"

namespace treeroll {

void TREEROLL_LANES_NAME(gmr_regress)(const gmr_kernel::Lines& lines, const double* inputs,
                                      double* weights, double* outputs) {
  using V = lanes::Widest;
  gmr_kernel::regress(lines, lanes::load<V>(inputs), weights,
                      [&](int o, V output) TREEROLL_LANE_LAMBDA {
                        for (int lane = 0; lane < lanes::kWidth<V>; ++lane) {
                          outputs[lane * lines.output_dim + o] = output[lane];
                        }
                      });
}

}  // namespace treeroll
