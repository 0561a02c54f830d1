#include "sim/equations_of_motion.h"

#include "common/base/elementary.h"

namespace treeroll::sim {

CartPendulumState state_derivative(const DoublePendulum& pendulum, const CartPendulumState& state,
                                   double cart_acceleration) {
  const auto& [l1, l2, a1, a2, m1, m2, j1, j2, d1, d2, g] = pendulum;
  const double w1 = state.phi1_rate, w2 = state.phi2_rate;
  const double s1 = elementary::sin(state.phi1), c1 = elementary::cos(state.phi1);
  const double s2 = elementary::sin(state.phi2), c2 = elementary::cos(state.phi2);
  const double sin12 = s1 * c2 - c1 * s2;  // of phi1 - phi2
  const double cos12 = c1 * c2 + s1 * s2;
  const double coupling = a2 * l1 * m2;

  // (B-7), left side.
  const double m_11 = j1 + a1 * a1 * m1 + l1 * l1 * m2;
  const double m_12 = coupling * cos12;
  const double m_22 = j2 + a2 * a2 * m2;
  // (B-7), right side.
  const double r1 = (a1 * m1 + l1 * m2) * (g * s1 + cart_acceleration * c1) -
                    coupling * sin12 * w2 * w2 - d1 * w1 - d2 * (w1 - w2);
  const double r2 =
      a2 * m2 * (g * s2 + cart_acceleration * c2) + coupling * sin12 * w1 * w1 + d2 * (w1 - w2);

  // The determinant is positive for every angle, as both inertias are.
  const double determinant = m_11 * m_22 - m_12 * m_12;
  return {.phi1 = w1,
          .phi2 = w2,
          .y = state.y_rate,
          .phi1_rate = (m_22 * r1 - m_12 * r2) / determinant,
          .phi2_rate = (m_11 * r2 - m_12 * r1) / determinant,
          .y_rate = cart_acceleration};
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
