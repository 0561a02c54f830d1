// Where a start is far from good, what it may be wrong by as a whole is tried.
#include "learner/explore/systematic_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"

namespace treeroll::explore {
namespace {

constexpr int kCoefficients = 8;

using Cubic = std::array<double, 4>;  // c[0] + c[1] t + ...

double value(const Cubic& c, double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
double slope(const Cubic& c, double t) { return c[1] + t * (2 * c[2] + t * 3 * c[3]); }

/// As splines over [0, 2], for each output a factor. A coefficient is the cubic's polar form at the
/// three knots inside its function's range.
LinearPolicy cubic_spline(const Cubic& c, const std::vector<double>& factors = {1}) {
  const auto knot = [](int i) { return .4 * std::clamp(i - 2, 0, 5); };
  Eigen::MatrixXd coefficients(factors.size(), kCoefficients);
  for (int i = 0; i < kCoefficients; ++i) {
    const double x = knot(i);
    const double y = knot(i + 1);
    const double z = knot(i + 2);
    const double polar =
        c[0] + c[1] * (x + y + z) / 3 + c[2] * (x * y + y * z + z * x) / 3 + c[3] * x * y * z;
    for (std::size_t o = 0; o < factors.size(); ++o) {
      coefficients(static_cast<Eigen::Index>(o), i) = factors[o] * polar;
    }
  }
  return {std::make_shared<SplineForm>(
              std::make_shared<SplineLadder>(BSpline(3, kCoefficients, 0, 2), 1), nullptr),
          coefficients, 1};
}

std::vector<Eigen::VectorXd> steps_of(const Policy& policy, double boldness = 1,
                                      int num_inputs = 1) {
  return systematic_steps(policy.effect(), boldness, num_inputs);
}

std::vector<double> outputs(const Policy& policy, const Eigen::VectorXd& theta, double time) {
  std::vector<double> out(static_cast<std::size_t>(policy.output_dim()));
  policy.with(theta)->controller()->act({&time, 1}, out);
  return out;
}

TEST(SystematicStepsTest, AreAGainAnOffsetADelayAndATempo) {
  const Cubic curve = {-5, 20, -25, 8};
  const std::vector<double> factors = {1, 100};
  const LinearPolicy policy = cubic_spline(curve, factors);
  double square = 0;
  for (int i = 0; i <= 1000; ++i) square += std::pow(value(curve, .002 * i), 2) / 1001;
  const std::vector<Eigen::VectorXd> steps = steps_of(policy);
  ASSERT_EQ(steps.size(), 4U);
  for (const double t : {0., .5, 1.3, 2.}) {
    const double delay = .05 * 2 * slope(curve, t);
    const double expected[] = {.3 * value(curve, t), .15 * std::sqrt(square), delay, delay * t / 2};
    for (std::size_t k = 0; k < 4; ++k) {
      const std::vector<double> changed = outputs(policy, policy.theta() + steps[k], t);
      for (std::size_t o = 0; o < 2; ++o) {
        EXPECT_NEAR(changed[o] / factors[o] - value(curve, t), expected[k], .03)
            << "step " << k << " of output " << o << " at " << t;
      }
    }
  }
}

TEST(SystematicStepsTest, OfSeveralInputsNoneIsTheTime) {
  EXPECT_EQ(steps_of(cubic_spline({-5, 20, -25, 8}), 1, 2).size(), 2U);
}

/// On a robot each would be a motion more.
TEST(SystematicStepsTest, NoneDoesNothingOrWhatOthersDo) {
  EXPECT_EQ(steps_of(cubic_spline({5, 0, 0, 0})).size(), 1U);  // a constant's offset is a gain
  EXPECT_EQ(steps_of(cubic_spline({2, 3, 0, 0})).size(), 2U);  // a line's delay is an offset
}

TEST(SystematicStepsTest, AreAsBoldAsTheStudyPermits) {
  const LinearPolicy policy = cubic_spline({-5, 20, -25, 8});
  EXPECT_TRUE(steps_of(policy, .1)[3].isApprox(.1 * steps_of(policy)[3]));
}

TEST(SystematicSearchTest, TriesShorterStepsFromTheBestSoFar) {
  const Eigen::VectorXd x = Eigen::Vector2d(1, 0);
  const Eigen::VectorXd y = Eigen::Vector2d(0, 1);
  const Eigen::VectorXd goal = Eigen::Vector2d(1, -.7);
  SystematicSearch search({0, -goal.norm(), Eigen::Vector2d::Zero()}, {x, y});
  std::vector<Eigen::VectorXd> asked;
  int rollout = 1;
  while (!search.is_over()) {
    std::vector<RatedRollout> generation;
    for (int i = 0; i < search.generation_size(); ++i) {
      asked.push_back(search.next());
      generation.push_back({rollout++, -(asked.back() - goal).norm(), asked.back()});
    }
    search.learn(generation);
  }
  ASSERT_EQ(asked.size(), 16U);
  EXPECT_EQ(asked[0], x);
  EXPECT_EQ(asked[1], -x);
  EXPECT_EQ(asked[3], -y);
  EXPECT_EQ(asked[4], x + .7 * x);  // from the best, x
  EXPECT_EQ(asked[7], x - .7 * y);
  EXPECT_EQ(search.best().theta, asked[7]);  // nothing after it is better
  EXPECT_EQ(search.best().rollout, 8);
}

}  // namespace
}  // namespace treeroll::explore
