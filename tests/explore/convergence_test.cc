#include "learner/explore/convergence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>

#include "common/numbers/random_stream.h"

namespace treeroll::explore {
namespace {

using ::testing::ElementsAre;

/// (3-7) as printed: the pseudo-inverse of [1 1; ..; N 1] times the rewards.
double slope_by_pseudo_inverse(const std::vector<double>& rewards) {
  const auto n = static_cast<Eigen::Index>(rewards.size());
  Eigen::MatrixXd design(n, 2);
  design.col(0).setLinSpaced(1, static_cast<double>(n));
  design.col(1).setOnes();
  const Eigen::MatrixXd inverse = design.completeOrthogonalDecomposition().pseudoInverse();
  return (inverse * Eigen::Map<const Eigen::VectorXd>(rewards.data(), n))(0);
}

TEST(LeastSquaresSlopeTest, IsThePseudoInversesOf37) {
  for (const int n : {2, 3, 4, 5, 20, 21, 100}) {
    RandomStream stream(1, 0, static_cast<std::uint32_t>(n), RandomPurpose::kPerturbation);
    std::vector<double> rewards;
    for (int i = 0; i < n; ++i) rewards.push_back(stream.next_uniform());
    EXPECT_NEAR(least_squares_slope(rewards), slope_by_pseudo_inverse(rewards), 1e-13) << n;
  }
}

TEST(LeastSquaresSlopeTest, IsTheStepOfALine) {
  EXPECT_DOUBLE_EQ(least_squares_slope(std::vector<double>{.1, .3, .5, .7}), .2);
  EXPECT_DOUBLE_EQ(least_squares_slope(std::vector<double>{3, 1}), -2);
}

TEST(LeastSquaresSlopeTest, IsExactlyZeroForEqualRewards) {
  for (std::size_t n = 2; n < 60; ++n) {
    EXPECT_EQ(least_squares_slope(std::vector<double>(n, .1)), 0) << n;
  }
}

TEST(RewardWindowTest, HoldsTheLastRewardsOldestFirst) {
  RewardWindow window(3);
  EXPECT_FALSE(window.slope());
  window.add(1);
  EXPECT_FALSE(window.slope());
  window.add(2);
  EXPECT_THAT(window.rewards(), ElementsAre(1, 2));
  EXPECT_EQ(window.slope(), 1);
  for (double reward = 3; reward <= 11; ++reward) {
    window.add(reward);
    EXPECT_THAT(window.rewards(), ElementsAre(reward - 2, reward - 1, reward));
  }
}

TEST(RewardWindowTest, ForgetsWhatHasLeftIt) {
  RewardWindow window(4);
  for (const double reward : {100., -50., 9., 8., 7., 6.}) window.add(reward);
  EXPECT_DOUBLE_EQ(*window.slope(), -1);
}

TEST(GainWindowTest, IsTheRecentGainOfTheBestBesideTheAverageComputedByHand) {
  GainWindow window(2);
  const double rewards[] = {.1, .5, .3, .6, .6};
  for (const double reward : rewards) window.add(reward);
  // The best so far: .1 .5 .5 .6 .6; over the last two .6 - .5, over all four steps .6 - .1.
  EXPECT_DOUBLE_EQ(*window.share(), (.1 / 2) / (.5 / 4));
}

TEST(GainWindowTest, AgreesWithTheWholeHistoryWhateverTheUnitOfTheReward) {
  for (const int capacity : {1, 2, 7, 60}) {
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
      RandomStream stream(seed, 0, 0, RandomPurpose::kPerturbation);
      GainWindow window(capacity);
      GainWindow in_other_units(capacity);
      std::vector<double> best;
      for (int i = 0; i < 200; ++i) {
        const double reward = stream.next_uniform();
        best.push_back(best.empty() ? reward : std::max(best.back(), reward));
        window.add(reward);
        in_other_units.add(8 * reward + 3);
        if (i < capacity || best.back() == best.front()) {
          EXPECT_FALSE(window.share()) << i;
          continue;
        }
        const double recent = (best.back() - best[best.size() - 1 - capacity]) / capacity;
        const double average = (best.back() - best.front()) / i;
        EXPECT_NEAR(*window.share(), recent / average, 1e-12) << "seed " << seed << ", " << i;
        EXPECT_NEAR(*in_other_units.share(), *window.share(), 1e-9);
      }
    }
  }
}

TEST(GainWindowTest, IsOneOnALineAndSaysNothingOfAPlateau) {
  GainWindow line(10);
  GainWindow plateau(10);
  for (int i = 0; i < 100; ++i) {
    line.add(.25 * i);
    plateau.add(.1);
  }
  EXPECT_DOUBLE_EQ(*line.share(), 1);
  EXPECT_FALSE(plateau.share());
  plateau.add(.2);
  EXPECT_TRUE(plateau.share());
}

}  // namespace
}  // namespace treeroll::explore
