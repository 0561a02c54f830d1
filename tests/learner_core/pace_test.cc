#include "learner/core/pace.h"

#include <gtest/gtest.h>

namespace treeroll::learner {
namespace {

TimePoint at_second(int s) { return TimePoint(std::chrono::seconds(s)); }

TEST(PaceTest, SaysNothingOfLongRolloutsBeforeEachEvaluatorHasAnswered) {
  Pace pace;
  for (int s = 0; s < 180; s += 2) {  // eight evaluators, thirty seconds each
    pace.note(at_second(s), 8 * (s / 30), 8);
    EXPECT_EQ(pace.per_s().has_value(), s >= 30) << s;
    if (s >= 30) {
      EXPECT_NEAR(pace.per_s().value_or(0), 8. / 30, .01) << s;
    }
  }
}

TEST(PaceTest, OneSlowEvaluatorIsKnownAfterAFewAnswers) {
  Pace pace;
  for (int s = 0; s < 400; ++s) pace.note(at_second(s), s / 30, 1);
  ASSERT_TRUE(pace.per_s());
  EXPECT_NEAR(*pace.per_s(), 1. / 30, .002);
}

TEST(PaceTest, ShortRolloutsAreKnownAtTheFirstLook) {
  Pace pace;
  pace.note(at_second(0), 0, 4);
  pace.note(at_second(2), 600, 4);
  EXPECT_EQ(pace.per_s(), 300);
}

TEST(PaceTest, FollowsWhatComesToAStop) {
  Pace pace;
  for (int s = 0; s <= 10; ++s) pace.note(at_second(s), 300 * s, 4);
  EXPECT_NEAR(*pace.per_s(), 300, 1);
  for (int s = 11; s <= 60; ++s) pace.note(at_second(s), 3000, 4);
  EXPECT_LT(*pace.per_s(), 10);
}

TEST(PaceTest, WhatAnEarlierLearnerDidIsNoPace) {
  Pace pace;
  pace.note(at_second(0), 5000, 1);
  pace.note(at_second(4), 5008, 1);
  EXPECT_EQ(pace.per_s(), 2);
}

}  // namespace
}  // namespace treeroll::learner
