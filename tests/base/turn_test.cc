#include "common/base/turn.h"

#include <gtest/gtest.h>

#include <chrono>
#include <variant>
#include <vector>

namespace treeroll {
namespace {

struct Ring {};
using Effect = std::variant<Ring, LogLine>;

TEST(TurnTest, ALineIsAnEffectInItsPlace) {
  LogLimiter limiter;
  std::vector<Effect> effects;
  const Turn<Effect> turn{TimePoint(std::chrono::hours(1)), effects, limiter};
  turn.effects.emplace_back(Ring{});
  turn.warn("bells", "the bell has rung");
  turn.effects.emplace_back(Ring{});
  ASSERT_EQ(effects.size(), 3U);
  const auto* line = std::get_if<LogLine>(&effects[1]);
  ASSERT_NE(line, nullptr);
  EXPECT_EQ(line->level, LogLine::Level::kWarning);
  EXPECT_EQ(line->text, "the bell has rung");
}

TEST(TurnTest, WhatIsLeftOutIsToldWhenDueAndTheRestAtTheEnd) {
  LogLimiter limiter;
  std::vector<Effect> effects;
  const TimePoint start{std::chrono::hours(1)};
  const Turn<Effect> first{start, effects, limiter};
  for (int i = 0; i < LogLimiter::kLinesMax + 5; ++i) first.inform("bells", "ring");
  EXPECT_EQ(effects.size(), std::size_t{LogLimiter::kLinesMax});
  first.log_due();
  EXPECT_EQ(effects.size(), std::size_t{LogLimiter::kLinesMax});
  const Turn<Effect> later{start + LogLimiter::kPeriod, effects, limiter};
  later.log_due();
  EXPECT_EQ(effects.size(), std::size_t{LogLimiter::kLinesMax} + 1);
  later.inform("bells", "ring");
  later.log_rest();
  EXPECT_EQ(effects.size(), std::size_t{LogLimiter::kLinesMax} + 2);
}

}  // namespace
}  // namespace treeroll
