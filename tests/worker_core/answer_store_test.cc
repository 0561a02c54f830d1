#include "workers/core/answer_store.h"

#include <gtest/gtest.h>

#include "common/protocol/limits.h"

namespace treeroll::worker {
namespace {

protocol::RolloutResult result(int number, std::int64_t content = 0) {
  return {
      .key = {.run = 0, .number = number}, .content = content, .outcome = Outcome::ok(.1 * number)};
}

TEST(AnswerStoreTest, NumbersResultsFromOneForEachLearner) {
  AnswerStore store(10);
  EXPECT_EQ(store.first_index(1), 1);
  EXPECT_EQ(store.last_index(1), 0);
  store.add(1, result(4));
  store.add(1, result(5));
  store.add(2, result(4));
  EXPECT_EQ(store.last_index(1), 2);
  EXPECT_EQ(store.last_index(2), 1);
  EXPECT_EQ(store.from(1, store.first_index(1), 999).size(), 2U);
  EXPECT_EQ(store.from(1, 1, 1).front().key.number, 4);
}

TEST(AnswerStoreTest, AcknowledgesAllUpToAnIndexAndNothingTwice) {
  AnswerStore store(10);
  for (int i = 0; i < 4; ++i) store.add(1, result(i));
  EXPECT_TRUE(store.acknowledge(1, 2));
  EXPECT_FALSE(store.acknowledge(1, 2));
  EXPECT_EQ(store.first_index(1), 3);
  EXPECT_TRUE(store.acknowledge(1, 1'000'000));
  EXPECT_TRUE(store.all_acknowledged());
  store.add(1, result(9));
  EXPECT_EQ(store.first_index(1), 5);
}

TEST(AnswerStoreTest, RepeatsUnderANewIndexOnlyWhatWasAcknowledged) {
  AnswerStore store(10);
  store.add(1, result(3));
  EXPECT_EQ(store.repeat(1, {0, 3}, 0, 4), 1);
  EXPECT_EQ(store.last_index(1), 1);
  EXPECT_EQ(store.from(1, store.first_index(1), 999).front().attempt, 4);
  store.acknowledge(1, 1);
  EXPECT_EQ(store.repeat(1, {0, 3}, 0, 5), 2);
  EXPECT_EQ(store.last_index(1), 2);
  EXPECT_FALSE(store.repeat(1, {0, 3}, 1, 5)) << "another content is another question";
  EXPECT_FALSE(store.repeat(2, {0, 3}, 0, 5)) << "another learner has not asked";
}

TEST(AnswerStoreTest, DropsTheOldestAcknowledgedFirst) {
  AnswerStore store(2);
  store.add(1, result(1));
  store.add(2, result(2));
  store.acknowledge(2, 1);
  store.add(1, result(3));  // goes: learner 2's
  EXPECT_FALSE(store.repeat(2, {0, 2}, 0, 1));
  EXPECT_TRUE(store.repeat(1, {0, 1}, 0, 1));
  store.add(1, result(4));  // none acknowledged: the oldest goes, the row has no gap
  EXPECT_EQ(store.size(), 2U);
  EXPECT_EQ(store.first_index(1), 2);
  EXPECT_EQ(store.from(1, store.first_index(1), 999).size(), 2U);
}

TEST(AnswerStoreTest, WhatIsAskedAgainForEverGrowsNothing) {
  AnswerStore store(10);
  for (int i = 0; i < 5; ++i) store.add(1, result(i));
  for (int round = 0; round < 100; ++round) {
    store.acknowledge(1, store.last_index(1));
    for (int i = 1; i < 5; ++i) EXPECT_TRUE(store.repeat(1, {0, i}, 0, round)) << i;
  }
  // The first one, which is not asked again, would keep all gaps behind it.
  EXPECT_FALSE(store.repeat(1, {0, 0}, 0, 0));
  EXPECT_EQ(store.size(), 4U);
  EXPECT_EQ(store.from(1, store.first_index(1), 999).size(), 4U);
}

TEST(AnswerStoreTest, RemembersHowFarItCountedForSomeThousandLearnersThatAreGone) {
  AnswerStore store(10);
  const auto num_kept = static_cast<protocol::LearnerId>(protocol::kForgottenLearnersMax);
  for (protocol::LearnerId learner = 1; learner <= num_kept + 5; ++learner) {
    store.add(learner, result(1));
    store.forget(learner);
  }
  EXPECT_EQ(store.last_index(5), 0);
  EXPECT_EQ(store.last_index(6), 1);
  EXPECT_EQ(store.last_index(num_kept + 5), 1);
}

TEST(AnswerStoreTest, GoesOnCountingForALearnerItHadForgotten) {
  AnswerStore store(10);
  store.add(1, result(1));
  store.add(1, result(2));
  store.forget(1);
  EXPECT_EQ(store.size(), 0U);
  EXPECT_TRUE(store.all_acknowledged());
  store.add(1, result(1));
  EXPECT_EQ(store.first_index(1), 3);
}

}  // namespace
}  // namespace treeroll::worker
