#include "workers/tasks/riccati.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/numbers/random_stream.h"

namespace treeroll {
namespace {

using sim::linear_dynamics;
using sim::LinearDynamics;
using sim::StateMatrix;
using sim::StateVector;

constexpr double kPi = std::numbers::pi;

/// That of METHOD's figures: angles 100, cart 10, rates 1.
QuadraticCost swing_up_weights() {
  return {(StateVector() << 100, 100, 10, 1, 1, 1).finished().asDiagonal(), .1};
}

/// A small system within the six numbers; the others die away by themselves and cost nothing.
LinearDynamics embedded(const Eigen::Matrix2d& a, const Eigen::Vector2d& b) {
  LinearDynamics dynamics{.by_state = -StateMatrix::Identity(), .by_input = StateVector::Zero()};
  dynamics.by_state.topLeftCorner<2, 2>() = a;
  dynamics.by_input.head<2>() = b;
  return dynamics;
}
QuadraticCost embedded_cost(const Eigen::Matrix2d& q, double r) {
  QuadraticCost cost{.by_state = StateMatrix::Zero(), .by_input = r};
  cost.by_state.topLeftCorner<2, 2>() = q;
  return cost;
}

/// The example of scipy.linalg.solve_continuous_are, which is that of Laub (1979).
TEST(RiccatiTest, GivesThePublishedSolution) {
  const Eigen::Matrix2d a = (Eigen::Matrix2d() << 4, 3, -4.5, -3.5).finished();
  const Eigen::Matrix2d q = (Eigen::Matrix2d() << 9, 6, 6, 4).finished();
  const auto p = stationary_riccati(embedded(a, {1, -1}), embedded_cost(q, 1));
  ASSERT_TRUE(p);
  EXPECT_NEAR((*p)(0, 0), 21.72792206, 1e-8);
  EXPECT_NEAR((*p)(0, 1), 14.48528137, 1e-8);
  EXPECT_NEAR((*p)(1, 1), 9.65685425, 1e-8);
}

/// x'' = u has P = [[sqrt 3, 1], [1, sqrt 3]] for unit weights.
TEST(RiccatiTest, GivesTheDoubleIntegratorsSolution) {
  const Eigen::Matrix2d a = (Eigen::Matrix2d() << 0, 1, 0, 0).finished();
  const auto p =
      stationary_riccati(embedded(a, {0, 1}), embedded_cost(Eigen::Matrix2d::Identity(), 1));
  ASSERT_TRUE(p);
  const Eigen::Matrix2d expected =
      (Eigen::Matrix2d() << std::sqrt(3), 1, 1, std::sqrt(3)).finished();
  EXPECT_LT(((*p).topLeftCorner<2, 2>() - expected).norm(), 1e-13);
}

/// Gains of scipy 1.10.1's solve_continuous_are for the same plant; upright also those that were
/// published for it to two places, with phi and u counted the other way: (-160.95, 260.41, -2.78,
/// 43.84) for angles and rates, (10.0, 15.26) for the cart.
TEST(RiccatiTest, GivesTheRegulatorsOfThePlant) {
  const std::pair<double, StateVector> expected[] = {
      {0, (StateVector() << 160.95173378650279, -260.41251882112397, 10, 2.779556338121472,
           -43.84116045683418, 15.25694207288792)
              .finished()},
      {-kPi, (StateVector() << -57.83264658341018, .514330611027214, 10, -3.6393451312533,
              -4.624089856238426, 12.118453420197026)
                 .finished()}};
  for (const auto& [phi, gains] : expected) {
    const LinearDynamics dynamics = linear_dynamics({}, {.phi1 = phi, .phi2 = phi}, 0);
    const auto p = stationary_riccati(dynamics, swing_up_weights());
    ASSERT_TRUE(p);
    const StateVector found = regulator_gains(dynamics.by_input, *p, swing_up_weights());
    EXPECT_LT((found - gains).norm(), 1e-8 * gains.norm()) << found.transpose();
    EXPECT_LT(regulator_speed(dynamics, found).slowest, -.9);
  }
  const LinearDynamics up = linear_dynamics({}, {}, 0);
  const StateMatrix p = *stationary_riccati(up, swing_up_weights());
  EXPECT_NEAR(regulator_speed(up, regulator_gains(up.by_input, p, swing_up_weights())).slowest,
              -1.122848619, 1e-6);
}

/// Whatever the plant: the equation holds, P is symmetric, and the regulator is stable.
TEST(RiccatiTest, SolvesTheEquationOfAnyPlant) {
  RandomStream random(5, 0, 0, RandomPurpose::kPopulation);
  for (int i = 0; i < 100; ++i) {
    LinearDynamics dynamics;
    for (double& number : dynamics.by_state.reshaped()) number = 2 * random.next_normal();
    for (double& number : dynamics.by_input.reshaped()) number = random.next_normal();
    const QuadraticCost cost{StateMatrix::Identity(), .5};
    const auto p = stationary_riccati(dynamics, cost);
    ASSERT_TRUE(p) << "plant " << i;
    EXPECT_EQ(*p, StateMatrix(p->transpose()));
    const StateVector gains = regulator_gains(dynamics.by_input, *p, cost);
    const StateMatrix pa = *p * dynamics.by_state;
    const StateMatrix rest =
        pa + pa.transpose() - gains * gains.transpose() * cost.by_input + cost.by_state;
    EXPECT_LT(rest.norm(), 1e-7 * pa.norm()) << "plant " << i;
    EXPECT_LT(regulator_speed(dynamics, gains).slowest, 0) << "plant " << i;
  }
}

TEST(RiccatiTest, SaysWhereThereIsNoRegulator) {
  // The second state grows and no input reaches it.
  const Eigen::Matrix2d apart = (Eigen::Matrix2d() << -1, 0, 0, 1).finished();
  EXPECT_FALSE(
      stationary_riccati(embedded(apart, {1, 0}), embedded_cost(Eigen::Matrix2d::Identity(), 1)));
  // A place that costs nothing is not come back to.
  const Eigen::Matrix2d mass = (Eigen::Matrix2d() << 0, 1, 0, 0).finished();
  EXPECT_FALSE(stationary_riccati(embedded(mass, {0, 1}),
                                  embedded_cost(Eigen::Vector2d(0, 1).asDiagonal(), 1)));
}

TEST(RiccatiTest, TheStationarySolutionStaysBackwardsInTime) {
  const LinearDynamics up = linear_dynamics({}, {}, 0);
  const StateMatrix p = *stationary_riccati(up, swing_up_weights());
  const auto gains = gains_backwards([&](double) { return up; }, 1, 1000, p, swing_up_weights());
  EXPECT_LT((gains.front() - gains.back()).norm(), 1e-7 * gains.back().norm());
}

/// Against scipy 1.10.1's solve_ivp (RK45, tolerance 1e-12) for a motion given in closed form.
TEST(RiccatiTest, FollowsAMotionBackwardsAsAnotherIntegratorDoes) {
  const StateMatrix end = *stationary_riccati(linear_dynamics({}, {}, 0), swing_up_weights());
  const auto dynamics = [](double t) {
    return linear_dynamics({},
                           {.phi1 = -kPi * std::cos(t) * std::cos(t),
                            .phi2 = std::sin(2 * t) - 1,
                            .y = .3 * t,
                            .phi1_rate = std::sin(3 * t),
                            .phi2_rate = 2 * std::cos(t),
                            .y_rate = .5},
                           4 * std::sin(5 * t));
  };
  const auto gains = gains_backwards(dynamics, 1.5, 1500, end, swing_up_weights());
  const StateVector middle =
      (StateVector() << -41.7210281773535, 22.758080148027904, 14.840010606815603,
       -21.634360187044404, -1.156486547742466, 18.031960066068855)
          .finished();
  const StateVector start =
      (StateVector() << -81.9220048435933, 203.07649102118253, 4.390823731638296,
       -8.796964320904518, 63.05959174726919, 1.710896800792145)
          .finished();
  EXPECT_LT((gains[750] - middle).norm(), 1e-6 * middle.norm()) << gains[750].transpose();
  EXPECT_LT((gains[0] - start).norm(), 1e-6 * start.norm()) << gains[0].transpose();
}

}  // namespace
}  // namespace treeroll
