#include "sim/equations_of_motion.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

#include "common/numbers/random_stream.h"

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

using Vector3 = std::array<double, 3>;
using Vector7 = std::array<double, 7>;

/// (B-2), corrected: places of the centres of gravity and the angles. phi is counted
/// counter-clockwise from upright, so that a link that leans has moved to the left.
Vector7 places(const DoublePendulum& p, const Vector3& q) {
  const double s1 = std::sin(q[0]), c1 = std::cos(q[0]);
  const double s2 = std::sin(q[1]), c2 = std::cos(q[1]);
  return {
      q[0], q[2] - p.a1 * s1, p.a1 * c1, q[1], q[2] - p.l1 * s1 - p.a2 * s2, p.l1 * c1 + p.a2 * c2,
      q[2]};
}

Vector3 moved(Vector3 q, const Vector3& direction, double step) {
  for (std::size_t i = 0; i < 3; ++i) q[i] += step * direction[i];
  return q;
}

/// Derivatives of places() along a direction by central differences of fourth order.
Vector7 first_derivative(const DoublePendulum& p, const Vector3& q, const Vector3& direction) {
  constexpr double kStep = 1e-3;
  Vector7 result{};
  for (const auto& [at, weight] : {std::pair{-2., 1.}, {-1., -8.}, {1., 8.}, {2., -1.}}) {
    const Vector7 there = places(p, moved(q, direction, at * kStep));
    for (std::size_t i = 0; i < 7; ++i) result[i] += weight * there[i] / (12 * kStep);
  }
  return result;
}

Vector7 second_derivative(const DoublePendulum& p, const Vector3& q, const Vector3& direction) {
  constexpr double kStep = 1e-3;
  Vector7 result{};
  for (const auto& [at, weight] :
       {std::pair{-2., -1.}, {-1., 16.}, {0., -30.}, {1., 16.}, {2., -1.}}) {
    const Vector7 there = places(p, moved(q, direction, at * kStep));
    for (std::size_t i = 0; i < 7; ++i) result[i] += weight * there[i] / (12 * kStep * kStep);
  }
  return result;
}

/// (B-7) follows from (B-1) to (B-6): J^T M (J qdd + c + g) = f in the rows of the angles, with the
/// Jacobian J of (B-2) and the convective accelerations c taken numerically.
TEST(EquationsOfMotionTest, FollowFromTheMassMatrixTheJacobianAndFrictionOfB1ToB6) {
  const DoublePendulum p{.d1 = .3, .d2 = .2};
  const Vector7 mass{p.j1, p.m1, p.m1, p.j2, p.m2, p.m2, 0};   // (B-3); the cart is driven
  const Vector7 gravity{0, 0, p.gravity, 0, 0, p.gravity, 0};  // (B-5), as what it takes to stay
  RandomStream random(3, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 100; ++i) {
    const CartPendulumState x = random_state(random);
    const double ydd = 5 * random.next_normal();
    const CartPendulumState derivative = state_derivative(p, x, ydd);
    const Vector3 q{x.phi1, x.phi2, x.y};
    const Vector3 rates{x.phi1_rate, x.phi2_rate, x.y_rate};
    const Vector3 accelerations{derivative.phi1_rate, derivative.phi2_rate, ydd};
    const std::array<Vector7, 3> jacobian{first_derivative(p, q, {1, 0, 0}),
                                          first_derivative(p, q, {0, 1, 0}),
                                          first_derivative(p, q, {0, 0, 1})};  // its columns
    const Vector7 convective = second_derivative(p, q, rates);                 // c
    const double w1 = rates[0], w2 = rates[1];
    const double friction[] = {-(p.d1 + p.d2) * w1 + p.d2 * w2, p.d2 * (w1 - w2)};  // (B-4)
    for (std::size_t row = 0; row < 2; ++row) {
      double force = 0, size = 0;
      for (std::size_t k = 0; k < 7; ++k) {
        double acceleration = convective[k] + gravity[k];
        for (std::size_t i = 0; i < 3; ++i) acceleration += jacobian[i][k] * accelerations[i];
        const double part = jacobian[row][k] * mass[k] * acceleration;
        force += part;
        size += std::fabs(part);
      }
      ASSERT_NEAR(force, friction[row], 1e-7 * (1 + size)) << "state " << i << ", row " << row;
    }
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
