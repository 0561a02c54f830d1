#include "sim/rk4_lanes.h"

#include "common/numbers/lanes.h"
#include "sim/rk4_kernel.h"

namespace treeroll::sim {

void TREEROLL_LANES_NAME(rk4_step)(const DoublePendulum& pendulum, double step_s,
                                   const double* inputs, double* states) {
  using V = lanes::Widest;
  constexpr int kWidth = lanes::kWidth<V>;
  const V at[] = {lanes::load<V>(inputs), lanes::load<V>(inputs + kWidth),
                  lanes::load<V>(inputs + kWidth), lanes::load<V>(inputs + 2 * kWidth)};
  const kernel::State<V> start = {lanes::load<V>(states),
                                  lanes::load<V>(states + kWidth),
                                  lanes::load<V>(states + 2 * kWidth),
                                  lanes::load<V>(states + 3 * kWidth),
                                  lanes::load<V>(states + 4 * kWidth),
                                  lanes::load<V>(states + 5 * kWidth)};
  const kernel::State<V> end = kernel::rk4_step(pendulum, step_s, start,
                                                [&](int stage, const kernel::State<V>&)
                                                    TREEROLL_LANE_LAMBDA { return at[stage]; });
  lanes::store(end.phi1, states);
  lanes::store(end.phi2, states + kWidth);
  lanes::store(end.y, states + 2 * kWidth);
  lanes::store(end.phi1_rate, states + 3 * kWidth);
  lanes::store(end.phi2_rate, states + 4 * kWidth);
  lanes::store(end.y_rate, states + 5 * kWidth);
}

}  // namespace treeroll::sim
