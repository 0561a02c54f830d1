#include "sim/equations_of_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/random_stream.h"

namespace treeroll::sim {
namespace {

CartPendulumState random_state(RandomStream& random) {
  return {.phi1 = 3 * random.next_normal(),
          .phi2 = 3 * random.next_normal(),
          .y = random.next_normal(),
          .phi1_rate = 5 * random.next_normal(),
          .phi2_rate = 5 * random.next_normal(),
          .y_rate = random.next_normal()};
}

CartPendulumState combined(const CartPendulumState& x, double factor, const CartPendulumState& d) {
  return {.phi1 = x.phi1 + factor * d.phi1,
          .phi2 = x.phi2 + factor * d.phi2,
          .y = x.y + factor * d.y,
          .phi1_rate = x.phi1_rate + factor * d.phi1_rate,
          .phi2_rate = x.phi2_rate + factor * d.phi2_rate,
          .y_rate = x.y_rate + factor * d.y_rate};
}

/// Energy changes by the work of the cart's acceleration and of friction (B-4) and by nothing else.
/// A missing term of (B-7), such as the gravity of the second row, breaks this.
TEST(EquationsOfMotionTest, EnergyChangesByTheWorkOfInputAndFriction) {
  const DoublePendulum p{.d1 = .3, .d2 = .2};
  RandomStream random(1, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 200; ++i) {
    const CartPendulumState x = random_state(random);
    const double ydd = 5 * random.next_normal();
    const CartPendulumState rate = state_derivative(p, x, ydd);
    const double h = 1e-5;
    const double power =
        (pendulum_energy(p, combined(x, h, rate)) - pendulum_energy(p, combined(x, -h, rate))) /
        (2 * h);
    const double w1 = x.phi1_rate, w2 = x.phi2_rate;
    const double friction = -p.d1 * w1 * w1 - p.d2 * (w1 - w2) * (w1 - w2);
    const double input = (p.a1 * p.m1 + p.l1 * p.m2) * std::cos(x.phi1) * ydd * w1 +
                         p.a2 * p.m2 * std::cos(x.phi2) * ydd * w2;
    ASSERT_NEAR(power, friction + input, 1e-5 * (1 + std::fabs(power))) << "state " << i;
  }
}

TEST(EquationsOfMotionTest, AreMirrorSymmetric) {
  const DoublePendulum p;
  RandomStream random(2, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 200; ++i) {
    const CartPendulumState x = random_state(random);
    const double ydd = 5 * random.next_normal();
    const CartPendulumState there = state_derivative(p, x, ydd);
    const CartPendulumState mirrored = state_derivative(p, combined({}, -1, x), -ydd);
    ASSERT_EQ(mirrored, combined({}, -1, there)) << "state " << i;
  }
}

TEST(EquationsOfMotionTest, RestUprightAndHanging) {
  const DoublePendulum p;
  EXPECT_EQ(state_derivative(p, {}, 0), CartPendulumState{});
  const CartPendulumState hanging = {.phi1 = M_PI, .phi2 = M_PI};
  const CartPendulumState rate = state_derivative(p, hanging, 0);
  EXPECT_NEAR(rate.phi1_rate, 0, 1e-14);
  EXPECT_NEAR(rate.phi2_rate, 0, 1e-14);
}

/// Counter-clockwise angles: a cart pushed to the right leaves the links behind, to the left.
TEST(EquationsOfMotionTest, APushToTheRightTiltsTheLowerLinkToTheLeft) {
  EXPECT_GT(state_derivative({}, {}, 1).phi1_rate, 0);
  EXPECT_EQ(state_derivative({}, {}, 1).y_rate, 1);
}

}  // namespace
}  // namespace treeroll::sim
