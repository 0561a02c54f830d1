#include "sim/cart_pendulum.h"

#include <cmath>

namespace treeroll::sim {

bool is_finite(const CartPendulumState& state) {
  return std::isfinite(state.phi1) && std::isfinite(state.phi2) && std::isfinite(state.y) &&
         std::isfinite(state.phi1_rate) && std::isfinite(state.phi2_rate) &&
         std::isfinite(state.y_rate);
}

}  // namespace treeroll::sim
