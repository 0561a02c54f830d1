#include "learner/core/results_read.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

TEST(ResultsReadTest, AdvancesOnlyWithoutGaps) {
  ResultsRead read;
  read.note(1, 3);
  read.note(6, 8);
  EXPECT_EQ(read.last_without_gap(), 3);
  EXPECT_TRUE(read.contains(7));
  EXPECT_FALSE(read.contains(5));
  read.note(5, 5);
  EXPECT_EQ(read.last_without_gap(), 3);
  read.note(4, 4);
  EXPECT_EQ(read.last_without_gap(), 8);
}

TEST(ResultsReadTest, WhatItsWorkerDoesNotGiveAnyMoreIsNoGap) {
  ResultsRead read;
  read.note(5, 6);
  read.forget_before(5);
  EXPECT_EQ(read.last_without_gap(), 6);
  read.forget_before(2);
  EXPECT_EQ(read.last_without_gap(), 6);
}

TEST(ResultsReadTest, IsTheSetOfAllThatWasNoted) {
  std::mt19937 dice(7);
  for (int round = 0; round < 200; ++round) {
    ResultsRead read;
    std::set<std::int64_t> all;
    for (int i = 0; i < 60; ++i) {
      const std::int64_t first = 1 + static_cast<std::int64_t>(dice() % 100);
      const std::int64_t last = first + static_cast<std::int64_t>(dice() % 6);
      read.note(first, last);
      for (std::int64_t index = first; index <= last; ++index) all.insert(index);
      std::int64_t expected = 0;
      while (all.contains(expected + 1)) ++expected;
      ASSERT_EQ(read.last_without_gap(), expected);
      for (std::int64_t index = 1; index < 110; ++index) {
        ASSERT_EQ(read.contains(index), all.contains(index)) << index;
      }
    }
  }
}

TEST(ResultsReadTest, KeepsABoundedNumberOfStretchesAndDoesNotNoteTheRest) {
  ResultsRead read;
  const auto num_stretches = static_cast<std::int64_t>(protocol::kStretchesReadMax);
  for (std::int64_t i = 1; i <= num_stretches + 10; ++i) read.note(2 * i, 2 * i);
  EXPECT_TRUE(read.contains(2 * num_stretches));
  EXPECT_FALSE(read.contains(2 * num_stretches + 2)) << "its worker repeats it";
}

}  // namespace
}  // namespace treeroll::learner
