#pragma once

#include "common/numbers/elementary_kernels.h"
#include "common/numbers/lanes.h"
#include "sim/double_pendulum.h"

/// The equations of motion and a step of Runge and Kutta as kernels over lanes
/// (common/numbers/lanes.h): V is one double, or a vector of them with a plant a lane.
namespace treeroll::sim::kernel {

/// CartPendulumState, a plant a lane.
template <class V>
struct State {
  V phi1, phi2, y;
  V phi1_rate, phi2_rate, y_rate;
};

/// Of one plant the two angles lie side by side, which takes a quarter off a step.
template <class V>
TREEROLL_LANE_INLINE void sin_cos_of_both(V phi1, V phi2, V& s1, V& c1, V& s2, V& c2) {
  if constexpr (lanes::kWidth<V> == 1) {
    lanes::Double2 sines, cosines;
    elementary::kernel::sin_cos(lanes::Double2{phi1, phi2}, sines, cosines);
    s1 = sines[0], s2 = sines[1], c1 = cosines[0], c2 = cosines[1];
  } else {
    elementary::kernel::sin_cos(phi1, s1, c1);
    elementary::kernel::sin_cos(phi2, s2, c2);
  }
}

/// state_derivative() of sim/equations_of_motion.h. Angles are neither wrapped nor bounded here:
/// past 2048 rad, 326 turns, their sines lose digits.
template <class V>
TREEROLL_LANE_INLINE State<V> derivative(const DoublePendulum& p, const State<V>& state,
                                         V cart_acceleration) {
  const V w1 = state.phi1_rate, w2 = state.phi2_rate;
  V s1, c1, s2, c2;
  sin_cos_of_both(state.phi1, state.phi2, s1, c1, s2, c2);
  const V sin12 = s1 * c2 - c1 * s2;  // of phi1 - phi2
  const V cos12 = c1 * c2 + s1 * s2;
  const double coupling = p.a2 * p.l1 * p.m2;

  // (B-7), left side.
  const double m_11 = p.j1 + p.a1 * p.a1 * p.m1 + p.l1 * p.l1 * p.m2;
  const V m_12 = coupling * cos12;
  const double m_22 = p.j2 + p.a2 * p.a2 * p.m2;
  // (B-7), right side.
  const V r1 = (p.a1 * p.m1 + p.l1 * p.m2) * (p.gravity * s1 + cart_acceleration * c1) -
               coupling * sin12 * w2 * w2 - p.d1 * w1 - p.d2 * (w1 - w2);
  const V r2 = p.a2 * p.m2 * (p.gravity * s2 + cart_acceleration * c2) +
               coupling * sin12 * w1 * w1 + p.d2 * (w1 - w2);

  // The determinant is positive for every angle, as both inertias are.
  const V determinant = m_11 * m_22 - m_12 * m_12;
  return {w1,
          w2,
          state.y_rate,
          (m_22 * r1 - m_12 * r2) / determinant,
          (m_11 * r2 - m_12 * r1) / determinant,
          cart_acceleration};
}

/// state + factor * derivative, element by element.
template <class V>
TREEROLL_LANE_INLINE State<V> moved(const State<V>& x, double factor, const State<V>& d) {
  return {x.phi1 + factor * d.phi1,
          x.phi2 + factor * d.phi2,
          x.y + factor * d.y,
          x.phi1_rate + factor * d.phi1_rate,
          x.phi2_rate + factor * d.phi2_rate,
          x.y_rate + factor * d.y_rate};
}

/// The classical step of order 4. `input(stage, state)` gives the acceleration of the cart at the
/// stages 0 to 3: at the step's start, twice in its middle, and at its end.
template <class V, class Input>
TREEROLL_LANE_INLINE State<V> rk4_step(const DoublePendulum& p, double h, const State<V>& x,
                                       Input&& input) {
  const State<V> k1 = derivative(p, x, input(0, x));
  const State<V> x2 = moved(x, h / 2, k1);
  const State<V> k2 = derivative(p, x2, input(1, x2));
  const State<V> x3 = moved(x, h / 2, k2);
  const State<V> k3 = derivative(p, x3, input(2, x3));
  const State<V> x4 = moved(x, h, k3);
  const State<V> k4 = derivative(p, x4, input(3, x4));
  return moved(moved(moved(moved(x, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
}

}  // namespace treeroll::sim::kernel
