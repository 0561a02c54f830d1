#include "workers/core/answer_index.h"

#include <gtest/gtest.h>

#include <map>

#include "common/numbers/random_stream.h"

namespace treeroll::worker {
namespace {

using Question = AnswerIndex::Question;

TEST(AnswerIndexTest, IsEmptyAtFirst) {
  const AnswerIndex index;
  EXPECT_EQ(index.size(), 0U);
  EXPECT_FALSE(index.find({{0, 0}, 0}));
}

TEST(AnswerIndexTest, TellsQuestionsApartByRunNumberAndContent) {
  AnswerIndex index;
  EXPECT_TRUE(index.set({{1, 2}, 3}, 1));
  EXPECT_TRUE(index.set({{2, 2}, 3}, 2));
  EXPECT_TRUE(index.set({{1, 3}, 3}, 3));
  EXPECT_TRUE(index.set({{1, 2}, 4}, 4));
  EXPECT_TRUE(index.set({{1, -2}, 3}, 5));
  EXPECT_FALSE(index.set({{1, 2}, 3}, 6));
  EXPECT_EQ(index.size(), 5U);
  EXPECT_EQ(index.find({{1, 2}, 3}), 6);
  EXPECT_EQ(index.find({{1, -2}, 3}), 5);
  EXPECT_FALSE(index.find({{2, 3}, 4}));
}

/// Questions of a small range, so that many searches run into each other, against a tree.
TEST(AnswerIndexTest, HoldsWhatATreeHoldsWhateverIsSetAndErased) {
  RandomStream random(7, 0, 0, RandomPurpose::kPopulation);
  AnswerIndex index;
  std::map<Question, std::int64_t> tree;
  for (std::int64_t step = 1; step <= 200'000; ++step) {
    const std::uint64_t bits = random.next_bits();
    const Question question{
        {static_cast<std::int32_t>(bits % 4), static_cast<std::int32_t>(bits / 4 % 32)},
        static_cast<std::int64_t>(bits / 128 % 8)};
    const auto found = tree.find(question);
    ASSERT_EQ(index.find(question),
              found == tree.end() ? std::nullopt : std::optional(found->second));
    if (found != tree.end() && bits >> 60U < 8) {
      index.erase(question);
      tree.erase(found);
    } else {
      EXPECT_EQ(index.set(question, step), found == tree.end());
      tree[question] = step;
    }
    ASSERT_EQ(index.size(), tree.size());
  }
  for (const auto& [question, place] : tree) EXPECT_EQ(index.find(question), place);
}

TEST(AnswerIndexDeathTest, WhatIsNotThereIsNotErased) {
  AnswerIndex index;
  EXPECT_DEATH(index.erase({{0, 0}, 0}), "not there");
  index.set({{0, 0}, 0}, 1);
  EXPECT_DEATH(index.erase({{0, 0}, 1}), "not there");
}

}  // namespace
}  // namespace treeroll::worker
