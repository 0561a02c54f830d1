#include "sim/equations_of_motion.h"

#include "common/numbers/elementary.h"
#include "sim/rk4_kernel.h"

namespace treeroll::sim {

CartPendulumState state_derivative(const DoublePendulum& pendulum, const CartPendulumState& s,
                                   double cart_acceleration) {
  const kernel::State<double> d = kernel::derivative<double>(
      pendulum, {s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate}, cart_acceleration);
  return {d.phi1, d.phi2, d.y, d.phi1_rate, d.phi2_rate, d.y_rate};
}

double pendulum_energy(const DoublePendulum& pendulum, const CartPendulumState& state) {
  const auto& [l1, l2, a1, a2, m1, m2, j1, j2, d1, d2, g] = pendulum;
  const double w1 = state.phi1_rate, w2 = state.phi2_rate;
  const double c1 = elementary::cos(state.phi1), c2 = elementary::cos(state.phi2);
  const double cos12 = elementary::cos(state.phi1 - state.phi2);
  const double kinetic = .5 * (j1 + a1 * a1 * m1 + l1 * l1 * m2) * w1 * w1 +
                         .5 * (j2 + a2 * a2 * m2) * w2 * w2 + a2 * l1 * m2 * cos12 * w1 * w2;
  const double potential = g * (m1 * a1 * c1 + m2 * (l1 * c1 + a2 * c2));
  return kinetic + potential;
}

}  // namespace treeroll::sim
