#include "sim/linear_dynamics.h"

#include "common/numbers/elementary.h"
#include "sim/equations_of_motion.h"

namespace treeroll::sim {

StateVector to_vector(const CartPendulumState& s) {
  return (StateVector() << s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate).finished();
}

CartPendulumState to_state(const StateVector& x) {
  return {
      .phi1 = x[0], .phi2 = x[1], .y = x[2], .phi1_rate = x[3], .phi2_rate = x[4], .y_rate = x[5]};
}

LinearDynamics linear_dynamics(const DoublePendulum& p, const CartPendulumState& state,
                               double cart_acceleration) {
  const double s1 = elementary::sin(state.phi1), c1 = elementary::cos(state.phi1);
  const double s2 = elementary::sin(state.phi2), c2 = elementary::cos(state.phi2);
  const double w1 = state.phi1_rate, w2 = state.phi2_rate;
  const double coupling = p.a2 * p.l1 * p.m2;
  const double coupling_sin12 = coupling * (s1 * c2 - c1 * s2);
  const double coupling_cos12 = coupling * (c1 * c2 + s1 * s2);
  const double arm1 = p.a1 * p.m1 + p.l1 * p.m2, arm2 = p.a2 * p.m2;
  const CartPendulumState rate = state_derivative(p, state, cart_acceleration);

  // (B-7) is M(phi) a = r, so that M da = dr - dM a. Rows: the two links; columns: phi1, phi2, the
  // two rates, the input. Of M only the coupling M12 depends on the angles.
  Eigen::Matrix<double, 2, 5> right;
  right << arm1 * (p.gravity * c1 - cart_acceleration * s1) - coupling_cos12 * w2 * w2,
      coupling_cos12 * w2 * w2, -p.d1 - p.d2, p.d2 - 2 * coupling_sin12 * w2, arm1 * c1,
      coupling_cos12 * w1 * w1,
      arm2 * (p.gravity * c2 - cart_acceleration * s2) - coupling_cos12 * w1 * w1,
      p.d2 + 2 * coupling_sin12 * w1, -p.d2, arm2 * c2;
  const Eigen::Vector2d by_phi1(coupling_sin12 * rate.phi2_rate, coupling_sin12 * rate.phi1_rate);
  right.col(0) += by_phi1;
  right.col(1) -= by_phi1;

  const double m11 = p.j1 + p.a1 * p.a1 * p.m1 + p.l1 * p.l1 * p.m2;
  const double m12 = coupling_cos12;
  const double m22 = p.j2 + p.a2 * p.a2 * p.m2;
  const double determinant = m11 * m22 - m12 * m12;
  LinearDynamics linear{.by_state = StateMatrix::Zero(), .by_input = StateVector::Zero()};
  for (int rate_of = 0; rate_of < 3; ++rate_of) linear.by_state(rate_of, 3 + rate_of) = 1;
  constexpr int kColumns[] = {0, 1, 3, 4};
  for (int k = 0; k < 5; ++k) {
    const double a1 = (m22 * right(0, k) - m12 * right(1, k)) / determinant;
    const double a2 = (m11 * right(1, k) - m12 * right(0, k)) / determinant;
    if (k < 4) {
      linear.by_state(3, kColumns[k]) = a1;
      linear.by_state(4, kColumns[k]) = a2;
    } else {
      linear.by_input << 0, 0, 0, a1, a2, 1;
    }
  }
  return linear;
}

}  // namespace treeroll::sim
