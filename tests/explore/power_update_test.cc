#include "learner/explore/power_update.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "common/numbers/random_stream.h"

namespace treeroll::explore {
namespace {

TEST(PowerUpdateTest, IsTheWeightedMeanAndSpreadComputedByHand) {
  const std::vector<RatedRollout> best{{3, 2, Eigen::Vector2d(1, 0)},
                                       {1, 1, Eigen::Vector2d(0, 2)}};
  const auto updated = power_update(best, Eigen::Vector2d(1, 1), Eigen::Vector2d(.1, .2));
  ASSERT_TRUE(updated);
  // (3-14): (2 [1 0] + 1 [0 2]) / 3.
  EXPECT_TRUE(updated->mean.isApprox(Eigen::Vector2d(2. / 3, 2. / 3), 1e-15));
  // (3-15): deviations (0, -1) and (-1, 1) from the mean before.
  Eigen::Matrix2d expected;
  expected << 1. / 3 + .1, -1. / 3, -1. / 3, 1 + .2;
  EXPECT_TRUE(updated->noise.isApprox(expected, 1e-15)) << updated->noise;
}

TEST(PowerUpdateTest, HasThreeParametersComputedByHand) {
  const std::vector<RatedRollout> best{{0, .75, Eigen::Vector3d(4, 0, 8)},
                                       {1, .25, Eigen::Vector3d(0, 4, 8)}};
  const auto updated = power_update(best, Eigen::Vector3d(0, 0, 8), Eigen::Vector3d(1, 1, 1));
  ASSERT_TRUE(updated);
  EXPECT_TRUE(updated->mean.isApprox(Eigen::Vector3d(3, 1, 8), 1e-15));
  EXPECT_TRUE(
      updated->noise.isApprox(Eigen::Vector3d(13, 5, 1).asDiagonal().toDenseMatrix(), 1e-15))
      << updated->noise;
}

TEST(PowerUpdateTest, GivesThePlainMeanForEqualRewards) {
  std::vector<RatedRollout> best;
  for (int i = 0; i < 5; ++i) best.push_back({i, .3, Eigen::Vector2d(i, i * i)});
  const auto updated = power_update(best, Eigen::Vector2d(0, 0), Eigen::Vector2d(.1, .1));
  ASSERT_TRUE(updated);
  EXPECT_TRUE(updated->mean.isApprox(Eigen::Vector2d(2, 6), 1e-14));
}

TEST(PowerUpdateTest, DoesNotDependOnTheScaleOfTheRewards) {
  const auto scaled = [](double scale) {
    const std::vector<RatedRollout> best{{0, 1 * scale, Eigen::Vector2d(1, 2)},
                                         {1, .5 * scale, Eigen::Vector2d(-3, 1)}};
    return *power_update(best, Eigen::Vector2d(.5, .5), Eigen::Vector2d(.1, .1));
  };
  for (const double scale : {0x1p-1000, 0x1p1000, 0x1p1023}) {
    EXPECT_EQ(scaled(scale).mean, scaled(1).mean) << scale;
    EXPECT_EQ(scaled(scale).noise, scaled(1).noise) << scale;
  }
}

TEST(PowerUpdateTest, MovesWithATurnAndAShiftOfTheSpace) {
  // An equal minimum noise in each direction turns into itself.
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    RandomStream random(seed, 0, 0, RandomPurpose::kPerturbation);
    const auto any = [&](Eigen::Index rows, Eigen::Index columns) -> Eigen::MatrixXd {
      return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.next_normal(); });
    };
    const Eigen::MatrixXd turn = Eigen::HouseholderQR<Eigen::MatrixXd>(any(4, 4)).householderQ();
    const Eigen::VectorXd shift = any(4, 1);
    const Eigen::VectorXd mean = any(4, 1);
    std::vector<RatedRollout> here;
    std::vector<RatedRollout> there;
    for (int i = 0; i < 6; ++i) {
      here.push_back({i, random.next_uniform(), any(4, 1)});
      there.push_back({i, here.back().reward, turn * here.back().theta + shift});
    }
    const Eigen::VectorXd minimum = Eigen::VectorXd::Constant(4, .1);
    const auto updated = power_update(here, mean, minimum);
    const auto turned = power_update(there, turn * mean + shift, minimum);
    EXPECT_LT((turned->mean - (turn * updated->mean + shift)).norm(), 1e-13) << seed;
    EXPECT_LT((turned->noise - turn * updated->noise * turn.transpose()).norm(), 1e-12) << seed;
  }
}

TEST(PowerUpdateTest, GivesASymmetricNoiseToTheLastBit) {
  const std::vector<RatedRollout> best{{0, .9, Eigen::Vector3d(.1, .7, -.3)},
                                       {1, .7, Eigen::Vector3d(.3, -.11, .77)}};
  const auto updated =
      power_update(best, Eigen::Vector3d(.01, .02, .03), Eigen::Vector3d(.1, .1, .1));
  ASSERT_TRUE(updated);
  EXPECT_EQ(updated->noise, updated->noise.transpose());
}

TEST(PowerUpdateTest, GivesNothingIfTheBestWeighNothing) {
  const std::vector<RatedRollout> best{{0, 0, Eigen::Vector2d(1, 2)},
                                       {1, 0, Eigen::Vector2d(3, 4)}};
  EXPECT_FALSE(power_update(best, Eigen::Vector2d(0, 0), Eigen::Vector2d(.1, .1)));
}

}  // namespace
}  // namespace treeroll::explore
