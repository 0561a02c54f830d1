#include "sim/linear_dynamics.h"

#include <gtest/gtest.h>

#include "common/numbers/random_stream.h"
#include "sim/equations_of_motion.h"

namespace treeroll::sim {
namespace {

StateVector rate(const DoublePendulum& p, const StateVector& x, double ydd) {
  return to_vector(state_derivative(p, to_state(x), ydd));
}

TEST(LinearDynamicsTest, AStateIsItsVector) {
  const CartPendulumState state{1, 2, 3, 4, 5, 6};
  EXPECT_EQ(to_vector(state), (StateVector() << 1, 2, 3, 4, 5, 6).finished());
  EXPECT_EQ(to_state(to_vector(state)), state);
}

/// Central differences of fourth order, at states of every kind and with friction that matters.
TEST(LinearDynamicsTest, AreTheDerivativesOfTheEquationsOfMotion) {
  const DoublePendulum p{.d1 = .3, .d2 = .2};
  RandomStream random(4, 0, 0, RandomPurpose::kPopulation);
  constexpr double kH = 1e-3;
  for (int i = 0; i < 200; ++i) {
    StateVector x;
    for (int j = 0; j < 6; ++j) x[j] = (j == 3 || j == 4 ? 5 : 3) * random.next_normal();
    const double ydd = 10 * random.next_normal();
    const LinearDynamics linear = linear_dynamics(p, to_state(x), ydd);
    const auto difference = [&](const StateVector& dx, double dydd) -> StateVector {
      const auto at = [&](double h) { return rate(p, x + h * dx, ydd + h * dydd); };
      return (8 * (at(kH) - at(-kH)) - (at(2 * kH) - at(-2 * kH))) / (12 * kH);
    };
    for (int j = 0; j < 6; ++j) {
      const StateVector expected = difference(StateVector::Unit(j), 0);
      ASSERT_LT((linear.by_state.col(j) - expected).norm(), 1e-6 * (1 + expected.norm()))
          << "state " << i << ", number " << j;
    }
    const StateVector expected = difference(StateVector::Zero(), 1);
    ASSERT_LT((linear.by_input - expected).norm(), 1e-8 * (1 + expected.norm())) << "state " << i;
  }
}

/// Small swings about upright and hanging differ in the sign of gravity alone.
TEST(LinearDynamicsTest, UprightAndHangingMirrorGravity) {
  const DoublePendulum p{.d1 = 0, .d2 = 0};
  const StateMatrix up = linear_dynamics(p, {}, 0).by_state;
  const StateMatrix down =
      linear_dynamics(p, {.phi1 = -3.14159265358979312, .phi2 = -3.14159265358979312}, 0).by_state;
  EXPECT_LT((up.block<2, 2>(3, 0) + down.block<2, 2>(3, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace treeroll::sim
