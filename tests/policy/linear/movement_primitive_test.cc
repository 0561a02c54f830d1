#include "common/policy/linear/movement_primitive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace treeroll {
namespace {

constexpr double kLow = .5, kHigh = 2.7;  // tau 2.2
constexpr int kNumWeights = 5;

std::vector<double> responses_at(const MovementPrimitive& primitive, double share) {
  std::vector<double> values(static_cast<std::size_t>(primitive.size()));
  primitive.values(kLow + share * (kHigh - kLow), values);
  return values;
}

/// tau^2 x'' = al (be (g - x) - tau x') is critically damped: its answers are known.
TEST(MovementPrimitiveTest, GoalAndStartAnswerAsACriticallyDampedSpringDoes) {
  const MovementPrimitive primitive(kNumWeights, kLow, kHigh);
  const RecordedCurvePtr from = primitive.from({1, -3});
  for (const double share : {0., .01, .1, .25, .5, 1.}) {
    const double r = 12.5 * share;
    const double of_start = (1 + r) * std::exp(-r);
    double start[2];
    from->at(kLow + share * (kHigh - kLow), start);
    EXPECT_NEAR(start[0], of_start, 1e-5) << share;
    EXPECT_NEAR(start[1], -3 * of_start, 3e-5) << share;
    EXPECT_NEAR(responses_at(primitive, share)[kNumWeights], 1 - of_start, 1e-5) << share;
  }
}

/// A weight's answer is the integral of its force against that of a blow, r exp(-12.5 r), by
/// Simpson's rule.
TEST(MovementPrimitiveTest, AWeightAnswersAsTheIntegralOfItsForceDoes) {
  const MovementPrimitive primitive(kNumWeights, kLow, kHigh);
  const double decay = std::log(100);
  const auto force = [&](int weight, double share) {
    const double s = std::exp(-decay * share);
    double sum = 0, own = 0;
    for (int i = 0; i < kNumWeights; ++i) {
      const auto centre = [&](int k) { return std::exp(-decay * k / (kNumWeights - 1)); };
      const int next = std::min(i, kNumWeights - 2);
      const double apart = centre(next) - centre(next + 1);
      const double psi = std::exp(-.5 * std::pow((s - centre(i)) / apart, 2));
      sum += psi;
      if (i == weight) own = psi;
    }
    return s * own / sum;
  };
  const auto answer = [&](int weight, double share) {
    constexpr int kParts = 2000;
    double sum = 0;
    for (int n = 0; n <= kParts; ++n) {
      const double at = share * n / kParts;
      const double factor = n == 0 || n == kParts ? 1 : n % 2 == 1 ? 4 : 2;
      sum += factor * (share - at) * std::exp(-12.5 * (share - at)) * force(weight, at);
    }
    return sum * share / kParts / 3;
  };
  // Answers are scaled: the ratio to the one in the middle is what is known.
  for (int weight = 0; weight < kNumWeights; ++weight) {
    const double scale =
        responses_at(primitive, .5)[static_cast<std::size_t>(weight)] / answer(weight, .5);
    for (const double share : {.1, .3, .7, 1.}) {
      const double known = scale * answer(weight, share);
      EXPECT_NEAR(responses_at(primitive, share)[static_cast<std::size_t>(weight)], known,
                  1e-4 * std::max(1., std::abs(known)))
          << weight << " at " << share;
    }
  }
}

TEST(MovementPrimitiveTest, EveryWeightCountsByTheOutputThatItMakes) {
  const MovementPrimitive primitive(10, kLow, kHigh);
  std::vector<double> inputs;
  for (int n = 0; n <= 4000; ++n) inputs.push_back(kLow + (kHigh - kLow) * n / 4000);
  const Eigen::MatrixXd all = primitive.matrix(inputs);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(std::sqrt(all.col(i).array().square().mean()), 1, 3e-3) << i;
  }
}

}  // namespace
}  // namespace treeroll
