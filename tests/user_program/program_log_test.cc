#include "workers/app/program_log.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

TEST(ProgramLogTest, PassesManyLinesOnceThenALineASecondOfAllEvaluators) {
  LineBudget budget(4);
  TimePoint now{std::chrono::seconds(1000)};
  for (int i = 0; i < LineBudget::kLinesAtOnce; ++i) EXPECT_TRUE(budget.allows(now)) << i;
  for (int i = 0; i < 7; ++i) EXPECT_FALSE(budget.allows(now)) << i;
  now += 4 * LineBudget::kPause;
  EXPECT_TRUE(budget.allows(now));
  EXPECT_EQ(budget.take_left_out(), 7);
  EXPECT_EQ(budget.take_left_out(), 0);
  EXPECT_FALSE(budget.allows(now));
}

TEST(ProgramLogTest, OneThatTalksAllDayFillsNoDisk) {
  constexpr int kEvaluators = 64;
  LineBudget budget(kEvaluators);
  int num_lines = 0;
  for (int tenth = 0; tenth < 864'000; ++tenth) {
    num_lines += budget.allows(TimePoint(tenth * std::chrono::milliseconds(100)));
  }
  EXPECT_LE(kEvaluators * num_lines, 86'400 + kEvaluators * (LineBudget::kLinesAtOnce + 1));
  EXPECT_GE(kEvaluators * num_lines, 86'400);
}

}  // namespace
}  // namespace treeroll::worker
