// Where a start is far from good, what it may be wrong by as a whole is tried.
#include "learner/explore/systematic_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"
#include "learner/explore/metric.h"

namespace treeroll::explore {
namespace {

constexpr int kCoefficients = 8;

/// Cubic splines over [0, 2]: for each output a line from `low` to `high` times its factor.
LinearPolicy line(double low, double high, std::vector<double> factors = {1}) {
  Eigen::MatrixXd coefficients(factors.size(), kCoefficients);
  for (int i = 0; i < kCoefficients; ++i) {
    // Where a coefficient stands: the mean of its three inner knots, on a grid of fifths.
    double place = 0;
    for (int knot = i - 2; knot <= i; ++knot) place += std::clamp(knot, 0, 5) / 15.;
    for (std::size_t o = 0; o < factors.size(); ++o) {
      coefficients(static_cast<Eigen::Index>(o), i) = factors[o] * (low + (high - low) * place);
    }
  }
  return {std::make_shared<SplineForm>(
              std::make_shared<SplineLadder>(BSpline(3, kCoefficients, 0, 2), 1), nullptr),
          coefficients, 1};
}

std::vector<Eigen::VectorXd> steps_of(const Policy& policy, double bold_step = 1e9,
                                      int num_inputs = 1) {
  const PolicyEffect effect = policy.effect();
  return systematic_steps(effect, step_covariance(effect, Metric::kFull, 1), bold_step, num_inputs);
}

std::vector<double> outputs(const Policy& policy, const Eigen::VectorXd& theta, double time) {
  std::vector<double> out(static_cast<std::size_t>(policy.output_dim()));
  policy.with(theta)->controller()->act({&time, 1}, out);
  return out;
}

/// y = 2 + 3 t on [0, 2], whose mean square is 28; and a hundred times that.
TEST(SystematicStepsTest, AreAGainAnOffsetADelayAndATempo) {
  const std::vector<double> factors = {1, 100};
  const LinearPolicy policy = line(2, 8, factors);
  const std::vector<Eigen::VectorXd> steps = steps_of(policy);
  ASSERT_EQ(steps.size(), 4U);
  for (const double time : {0., .5, 1.3, 2.}) {
    const double y = 2 + 3 * time;
    const double expected[] = {.3 * y, .15 * std::sqrt(28.), .05 * 6, .05 * 6 * time / 2};
    for (std::size_t k = 0; k < 4; ++k) {
      const std::vector<double> changed = outputs(policy, policy.theta() + steps[k], time);
      for (std::size_t o = 0; o < 2; ++o) {
        EXPECT_NEAR(changed[o] / factors[o] - y, expected[k], .02)
            << "step " << k << " of output " << o << " at " << time;
      }
    }
  }
}

TEST(SystematicStepsTest, OfSeveralInputsNoneIsTheTime) {
  EXPECT_EQ(steps_of(line(2, 8), 1e9, 2).size(), 2U);
}

/// A study that asks for small first steps gets small ones.
TEST(SystematicStepsTest, AreAsBoldAsTheStudyPermits) {
  const LinearPolicy policy = line(5, 5);
  EXPECT_EQ(steps_of(policy, .4), steps_of(policy));
  EXPECT_TRUE(steps_of(policy, .04)[0].isApprox(.1 * steps_of(policy)[0]));
}

TEST(SystematicStepsTest, APolicyThatDoesNothingHasNone) {
  EXPECT_TRUE(steps_of(line(0, 0)).empty());
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
