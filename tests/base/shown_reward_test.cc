#include "common/base/shown_reward.h"

#include <gtest/gtest.h>

namespace treeroll {
namespace {

TEST(ShownRewardTest, ThreeDecimalsOrThreeSignificantDigits) {
  EXPECT_EQ(shown_reward(.9784), "0.978");
  EXPECT_EQ(shown_reward(1), "1.000");
  EXPECT_EQ(shown_reward(1234.5678), "1234.568");
  EXPECT_EQ(shown_reward(-.041), "-0.041");
  EXPECT_EQ(shown_reward(.0012345), "0.00123");
  EXPECT_EQ(shown_reward(-.0056789), "-0.00568");
  EXPECT_EQ(shown_reward(1.2345e-7), "1.23e-07");
  EXPECT_EQ(shown_reward(4.94e-324), "4.94e-324");
  EXPECT_EQ(shown_reward(0), "0");
}

}  // namespace
}  // namespace treeroll
