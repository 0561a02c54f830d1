#include "workers/core/held_slice.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

using protocol::kFirstKey;
using protocol::kLastKey;
using protocol::RolloutKey;

/// Whatever the size of a message: each roll-out is in one slice, and slices leave no gap.
TEST(HeldSliceTest, SlicesTogetherNameAllThatIsHeldOnce) {
  std::vector<RolloutKey> held;
  for (int run = 0; run < 7; ++run) {
    for (const int number : {-1, 0, 5, kLastKey.number}) held.push_back({run, number});
  }
  for (std::size_t num_max = 1; num_max <= held.size() + 1; ++num_max) {
    std::vector<RolloutKey> together;
    RolloutKey from = kFirstKey;
    RolloutKey last = kFirstKey;
    while (last != kLastKey) {
      const HeldSlice slice = slice_of(held, from, num_max);
      EXPECT_LE(slice.keys.size(), num_max);
      EXPECT_EQ(slice.first, from);
      for (const RolloutKey key : slice.keys) {
        EXPECT_TRUE(slice.first <= key && key <= slice.last);
      }
      together.insert(together.end(), slice.keys.begin(), slice.keys.end());
      last = slice.last;
      from = slice.next();
    }
    EXPECT_EQ(together, held) << num_max;
    EXPECT_EQ(from, kFirstKey) << "and it begins again";
  }
}

TEST(HeldSliceTest, WhatFitsIsNamedWholeWhereverTheLastOneEnded) {
  const HeldSlice slice = slice_of({{0, 1}, {0, 2}}, {5, 5}, 2);
  EXPECT_EQ(slice.keys.size(), 2U);
  EXPECT_EQ(slice.first, kFirstKey);
  EXPECT_EQ(slice.last, kLastKey);
}

TEST(HeldSliceTest, NothingHeldIsSaidOfAll) {
  const HeldSlice slice = slice_of({}, kFirstKey, 1);
  EXPECT_TRUE(slice.keys.empty());
  EXPECT_EQ(slice.first, kFirstKey);
  EXPECT_EQ(slice.last, kLastKey);
}

}  // namespace
}  // namespace treeroll::worker
