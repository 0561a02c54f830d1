#include "workers/app/program_log.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

TEST(ProgramLogTest, PassesFiftyLinesASecondAndCountsTheRest) {
  LineBudget budget;
  TimePoint now{std::chrono::seconds(1000)};
  for (int i = 0; i < LineBudget::kLinesPerSecond; ++i) EXPECT_TRUE(budget.allows(now)) << i;
  for (int i = 0; i < 7; ++i) EXPECT_FALSE(budget.allows(now)) << i;
  now += std::chrono::seconds(1);
  EXPECT_TRUE(budget.allows(now));
  EXPECT_EQ(budget.take_left_out(), 7);
  EXPECT_EQ(budget.take_left_out(), 0);
}

}  // namespace
}  // namespace treeroll::worker
