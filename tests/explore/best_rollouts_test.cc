#include "learner/explore/best_rollouts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/numbers/random_stream.h"

namespace treeroll::explore {
namespace {

std::vector<int> numbers(const BestRollouts& best) {
  std::vector<int> result;
  for (const RatedRollout& rollout : best.ranked()) result.push_back(rollout.rollout);
  return result;
}

RatedRollout rated(int rollout, double reward) {
  return {rollout, reward, Eigen::VectorXd::Constant(1, rollout)};
}

TEST(BestRolloutsTest, RanksByRewardAndEqualRewardsByNumber) {
  BestRollouts best(3);
  best.add(rated(4, .5));
  best.add(rated(2, .5));
  EXPECT_EQ(numbers(best), (std::vector<int>{2, 4}));
  best.add(rated(7, .9));
  best.add(rated(3, .5));
  EXPECT_EQ(numbers(best), (std::vector<int>{7, 2, 3}));
  best.add(rated(9, .5));
  EXPECT_EQ(numbers(best), (std::vector<int>{7, 2, 3}));
  EXPECT_EQ(best.ranked()[1].theta(0), 2);
}

TEST(BestRolloutsTest, IsTheHeadOfTheSortedHistoryWhateverTheOrderOfArrival) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    RandomStream stream(seed, 0, 0, RandomPurpose::kPerturbation);
    std::vector<RatedRollout> history;
    BestRollouts best(5);
    for (int i = 0; i < 40; ++i) {
      // Few distinct rewards, so that ties are frequent; numbers in a scrambled order.
      history.push_back(rated(i * 17 % 40, static_cast<double>(stream.next_bits() % 6)));
      best.add(history.back());
    }
    std::sort(history.begin(), history.end(), ranks_before);
    ASSERT_EQ(best.ranked().size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(best.ranked()[i].rollout, history[i].rollout) << "seed " << seed << ", w " << i;
    }
  }
}

}  // namespace
}  // namespace treeroll::explore
