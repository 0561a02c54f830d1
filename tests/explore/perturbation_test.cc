#include "learner/explore/perturbation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

namespace treeroll::explore {
namespace {

RandomStream stream_of(std::uint32_t rollout) {
  return {5, 2, rollout, RandomPurpose::kPerturbation};
}

TEST(PerturbationTest, HasTheMomentsOfTheNoise) {
  Eigen::Matrix3d noise;
  noise << 2, .6, -.4, .6, 1, .3, -.4, .3, .5;
  const Eigen::Vector3d mean(1, -2, 3);
  const Eigen::MatrixXd factor = noise_factor(noise);
  constexpr int kDraws = 40000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sum_of_squares = Eigen::Matrix3d::Zero();
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    const Eigen::Vector3d deviation = perturb(mean, factor, normal_numbers(3, stream_of(i))) - mean;
    sum += deviation;
    sum_of_squares += deviation * deviation.transpose();
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(sum(i) / kDraws, 0, 4 * std::sqrt(noise(i, i) / kDraws));
    for (int j = 0; j < 3; ++j) {
      const double variance_of_product = noise(i, i) * noise(j, j) + noise(i, j) * noise(i, j);
      EXPECT_NEAR(sum_of_squares(i, j) / kDraws, noise(i, j),
                  4 * std::sqrt(variance_of_product / kDraws));
    }
  }
}

TEST(PerturbationTest, UsesTheNormalNumbersOfTheStreamInOrder) {
  RandomStream stream = stream_of(3);
  const double first = stream.next_normal();
  const double second = stream.next_normal();
  const Eigen::Vector2d theta =
      perturb(Eigen::Vector2d(10, 20), noise_factor(Eigen::Vector2d(4, 9).asDiagonal()),
              normal_numbers(2, stream_of(3)));
  EXPECT_DOUBLE_EQ(theta(0), 10 + 2 * first);
  EXPECT_DOUBLE_EQ(theta(1), 20 + 3 * second);
}

TEST(PerturbationTest, FactorisesANoiseThatIsSingularWithinRounding) {
  // Rank one by construction; the last pivots are rounding errors of either sign.
  Eigen::VectorXd direction(6);
  direction << .1, .7, -.3, .9, 1e-4, 3;
  const Eigen::MatrixXd noise = direction * direction.transpose();
  ASSERT_NE(Eigen::LLT<Eigen::MatrixXd>(noise).info(), Eigen::Success) << "an easy case";
  const Eigen::MatrixXd factor = noise_factor(noise);
  EXPECT_TRUE(factor.allFinite());
  EXPECT_LT((factor * factor.transpose() - noise).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PerturbationDeathTest, RefusesWhatIsNoCovariance) {
  Eigen::Matrix2d indefinite;
  indefinite << 1, 2, 2, 1;
  EXPECT_DEATH(noise_factor(indefinite), "not positive semi-definite");
  EXPECT_DEATH(noise_factor(Eigen::Matrix2d::Zero()), "variances above 0");
  EXPECT_FALSE(noise_factor_if_any(indefinite));
  EXPECT_FALSE(noise_factor_if_any(Eigen::Matrix2d::Constant(NAN)));
  EXPECT_TRUE(noise_factor_if_any(Eigen::Matrix2d::Identity()));
}

}  // namespace
}  // namespace treeroll::explore
