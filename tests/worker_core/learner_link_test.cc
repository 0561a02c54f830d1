#include "workers/core/learner_link.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;

class LearnerLinkTest : public ::testing::Test {
 protected:
  WorkerSettings settings_;
  TimePoint now_{1h};
  LearnerLink link_{settings_, 3, now_};
};

TEST_F(LearnerLinkTest, RepeatsEverMoreSeldomUntilSomethingIsSeen) {
  link_.hear(now_);
  link_.on_sent(now_, 5);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_min);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(link_.begin_repetition(now_, 1), 4);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_max);
  link_.on_acknowledged(now_, 4, true, false);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_min);
  EXPECT_EQ(link_.begin_repetition(now_, 1), 5);
  link_.on_acknowledged(now_, 5, true, false);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.settle_interval_min);
  EXPECT_EQ(link_.begin_repetition(now_, 3), 3) << "all are seen, the oldest is not settled";
  link_.on_acknowledged(now_, 5, false, true);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.learner_gone);
  link_.give_up();
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.learner_silence_max);
}

TEST_F(LearnerLinkTest, NoBatchOfSomebodyElseRunsAheadForGood) {
  link_.hear_batch(now_, 1000, true);
  link_.hear_batch(now_, std::int64_t{1} << 60U, false);
  EXPECT_EQ(link_.last_batch(), 1000) << "too far ahead to be the learner's";
  link_.hear_batch(now_, 1'000'000, false);
  EXPECT_EQ(link_.last_batch(), 1'000'000);
  link_.hear_batch(now_, 1001, true);
  EXPECT_EQ(link_.last_batch(), 1001) << "the learner's own word sets it right";
  EXPECT_EQ(link_.batches_received(), 1);
  link_.hear_batch(now_, 1002, false);
  EXPECT_EQ(link_.batches_received(), 3);
}

TEST_F(LearnerLinkTest, ABatchThatWasOvertakenSetsNothingBack) {
  link_.hear_batch(now_, 1000, true);
  link_.hear_batch(now_, 1000 + protocol::kBatchBits, false);
  link_.hear_batch(now_, 1000, true);
  EXPECT_EQ(link_.last_batch(), 1000 + protocol::kBatchBits);
}

TEST_F(LearnerLinkTest, WhatIsNewDoesNotPutOffTheRepetitionOfWhatWasSentBefore) {
  link_.on_sent(now_, 4);
  link_.on_sent(now_ + settings_.repeat_interval_min / 2, 5);
  EXPECT_TRUE(link_.repetition_due(now_ + settings_.repeat_interval_min));
}

TEST_F(LearnerLinkTest, AWordAboutWhatWasNeverSentSaysNothingBeyondTheLast) {
  link_.on_sent(now_, 4);
  link_.on_acknowledged(now_, 1'000'000, true, false);
  link_.on_sent(now_, 5);
  EXPECT_EQ(link_.begin_repetition(now_, 1), 5);
  link_.on_acknowledged(now_, 2, true, false);
  EXPECT_EQ(link_.begin_repetition(now_, 1), 5) << "what was seen stays seen";
}

TEST_F(LearnerLinkTest, AsksAtOnceForWhatIsNewAndAgainForWhatHasNotCome) {
  const DefinitionName task{DefinitionKind::kTask, content_hash("a")};
  const DefinitionName policy{DefinitionKind::kPolicy, content_hash("b")};
  EXPECT_TRUE(link_.ask(now_, {task}));
  EXPECT_FALSE(link_.ask(now_, {task}));
  EXPECT_TRUE(link_.ask(now_, {task, policy}));
  EXPECT_FALSE(link_.ask(now_, {policy}));
  EXPECT_FALSE(link_.asking_due(now_));
  EXPECT_TRUE(link_.asking_due(now_ + settings_.ask_interval_min));
  EXPECT_TRUE(link_.ask(now_ + settings_.ask_interval_min, {policy}));
  EXPECT_FALSE(link_.ask(now_, {}));
  EXPECT_FALSE(link_.asking_due(now_ + 1h));
}

}  // namespace
}  // namespace treeroll::worker
