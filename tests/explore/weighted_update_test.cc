#include "learner/explore/weighted_update.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/numbers/random_stream.h"

namespace treeroll::explore {
namespace {

ToldRollout member(int rollout, double reward, const Eigen::VectorXd& theta,
                   const Eigen::VectorXd& mean) {
  const Eigen::MatrixXd noise = Eigen::MatrixXd::Identity(mean.size(), mean.size());
  return {{rollout, reward, theta},
          std::make_shared<SearchDistribution>(SearchDistribution{mean, noise})};
}

TEST(WeightedUpdateTest, Pi2IsTheSoftmaxComputedByHand) {
  const Eigen::VectorXd mean = Eigen::VectorXd::Constant(1, 1);
  const std::vector<ToldRollout> generation = {
      member(0, .2, Eigen::VectorXd::Constant(1, 2), mean),
      member(1, .6, Eigen::VectorXd::Constant(1, 4), mean),
      member(2, .4, Eigen::VectorXd::Constant(1, 0), mean)};
  const std::vector<double> weights = pi2_weights(generation, std::log(4));
  // exp(-h), 1 and exp(-h / 2): 1/4, 1 and 1/2, divided by 7/4.
  EXPECT_NEAR(weights[0], 1. / 7, 1e-15);
  EXPECT_NEAR(weights[1], 4. / 7, 1e-15);
  EXPECT_NEAR(weights[2], 2. / 7, 1e-15);

  const SearchDistribution before{mean, Eigen::MatrixXd::Constant(1, 1, 5)};
  const Eigen::VectorXd minimum = Eigen::VectorXd::Constant(1, .3);
  const SearchDistribution whole = weighted_update(generation, weights, before, {1, 1, minimum});
  EXPECT_NEAR(whole.mean[0], 18. / 7, 1e-14);
  EXPECT_NEAR(whole.noise(0, 0), (1 * 1 + 4 * 9 + 2 * 1) / 7. + .3, 1e-14);
  const SearchDistribution part = weighted_update(generation, weights, before, {.25, .8, minimum});
  EXPECT_NEAR(part.mean[0], 18. / 7, 1e-14);
  EXPECT_NEAR(part.noise(0, 0), .75 * .8 * 5 + .25 * (.8 * 39 / 7. + .3), 1e-14);
}

TEST(WeightedUpdateTest, Pi2DoesNotSeeAnAffineChangeOfTheRewards) {
  const Eigen::VectorXd mean = Eigen::VectorXd::Zero(2);
  std::vector<ToldRollout> generation;
  std::vector<ToldRollout> changed;
  RandomStream random(3, 0, 0, RandomPurpose::kPerturbation);
  for (int i = 0; i < 20; ++i) {
    const double reward = random.next_uniform();
    const Eigen::Vector2d theta(random.next_normal(), random.next_normal());
    generation.push_back(member(i, reward, theta, mean));
    changed.push_back(member(i, 1000 + 37 * reward, theta, mean));
  }
  const std::vector<double> weights = pi2_weights(generation, 10);
  const std::vector<double> of_changed = pi2_weights(changed, 10);
  for (std::size_t i = 0; i < weights.size(); ++i) EXPECT_NEAR(weights[i], of_changed[i], 1e-11);
}

TEST(WeightedUpdateTest, EqualRewardsGiveThePlainMean) {
  const Eigen::VectorXd mean = Eigen::VectorXd::Zero(1);
  std::vector<ToldRollout> generation;
  for (int i = 0; i < 4; ++i) {
    generation.push_back(member(i, .5, Eigen::VectorXd::Constant(1, i), mean));
  }
  for (const double weight : pi2_weights(generation, 10)) EXPECT_EQ(weight, .25);
  for (const double weight : cem_weights(generation, 4)) EXPECT_EQ(weight, .25);
}

TEST(WeightedUpdateTest, CemTakesTheEliteAndSeesOnlyRanks) {
  const Eigen::VectorXd mean = Eigen::VectorXd::Zero(1);
  std::vector<ToldRollout> generation;
  std::vector<ToldRollout> monotone;
  const double rewards[] = {.1, .7, .3, .7, .2};
  for (int i = 0; i < 5; ++i) {
    generation.push_back(member(i, rewards[i], Eigen::VectorXd::Constant(1, i), mean));
    monotone.push_back(member(i, std::exp(9 * rewards[i]), Eigen::VectorXd::Constant(1, i), mean));
  }
  const std::vector<double> weights = cem_weights(generation, 2);
  EXPECT_EQ(weights, (std::vector<double>{0, .5, 0, .5, 0}));
  EXPECT_EQ(cem_weights(monotone, 2), weights);
  // Of equal rewards the lower number is the elite.
  EXPECT_EQ(cem_weights(generation, 1), (std::vector<double>{0, 1, 0, 0, 0}));
  const SearchDistribution next =
      weighted_update(generation, weights, {mean, Eigen::MatrixXd::Identity(1, 1)},
                      {1, 1, Eigen::VectorXd::Constant(1, .5)});
  EXPECT_EQ(next.mean[0], 2);
  EXPECT_EQ(next.noise(0, 0), .5 * (1 + 9) + .5);
}

TEST(WeightedUpdateTest, AStaleMemberCountsWithItsOwnPerturbation) {
  const Eigen::VectorXd now = Eigen::VectorXd::Constant(1, 10);
  const Eigen::VectorXd then = Eigen::VectorXd::Constant(1, 4);
  const std::vector<ToldRollout> generation = {member(0, 1, Eigen::VectorXd::Constant(1, 5), then),
                                               member(1, 1, Eigen::VectorXd::Constant(1, 12), now)};
  const std::vector<double> weights = {.5, .5};
  const SearchDistribution next =
      weighted_update(generation, weights, {now, Eigen::MatrixXd::Identity(1, 1)},
                      {1, 1, Eigen::VectorXd::Zero(1)});
  EXPECT_EQ(next.mean[0], 8.5);
  EXPECT_EQ(next.noise(0, 0), .5 * 1 + .5 * 4);
}

/// One dimension, in closed form: the best quarter of a normal distribution.
TEST(WeightedUpdateTest, CemOnALinearRewardMovesByTheSelectionIntensity) {
  constexpr int kMembers = 40'000;
  const Eigen::VectorXd mean = Eigen::VectorXd::Constant(1, 3);
  std::vector<ToldRollout> generation;
  for (int i = 0; i < kMembers; ++i) {
    RandomStream random(5, 0, static_cast<std::uint32_t>(i), RandomPurpose::kPerturbation);
    const double z = random.next_normal();
    generation.push_back(member(i, 50 + z, Eigen::VectorXd::Constant(1, 3 + 2 * z), mean));
  }
  const SearchDistribution next =
      weighted_update(generation, cem_weights(generation, kMembers / 4),
                      {mean, Eigen::MatrixXd::Constant(1, 1, 4)}, {1, 1, Eigen::VectorXd::Zero(1)});
  // The best quarter of N(0, 1) lies above q = .67449; its mean is phi(q) / .25 = 1.27111 and its
  // second moment 1 + q phi(q) / .25 = 1.85735.
  EXPECT_NEAR(next.mean[0], 3 + 2 * 1.27111, .03);
  EXPECT_NEAR(next.noise(0, 0), 4 * 1.85735, .15);
}

}  // namespace
}  // namespace treeroll::explore
