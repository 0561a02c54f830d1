#include "workers/core/learner_link.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;

class LearnerLinkTest : public ::testing::Test {
 protected:
  WorkerSettings settings_;
  TimePoint now_{1h};
  LearnerLink link_{settings_, 3};
};

TEST_F(LearnerLinkTest, WhatWasAnsweredBeforeItWasMetIsNotDue) {
  EXPECT_FALSE(link_.answers_due(3));
  EXPECT_TRUE(link_.answers_due(4));
  link_.want_answers();
  EXPECT_TRUE(link_.answers_due(3));
  link_.on_sent(now_, 3);
  EXPECT_FALSE(link_.answers_due(3));
}

TEST_F(LearnerLinkTest, RepeatsEverMoreSeldomUntilSomethingIsAcknowledged) {
  link_.hear(now_);
  link_.on_sent(now_, 4);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_min);
  for (int i = 0; i < 20; ++i) {
    link_.back_off(4);
    link_.on_sent(now_, 4);
  }
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_max);
  link_.on_acknowledged(now_, true);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.repeat_interval_min);
  link_.on_acknowledged(now_, false);
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.learner_gone);
  link_.give_up();
  EXPECT_EQ(link_.next_deadline(), now_ + settings_.learner_silence_max);
}

TEST_F(LearnerLinkTest, DoesNotBackOffWhileAnswersWaitForRoom) {
  link_.on_sent(now_, 4);
  link_.back_off(9);
  link_.on_sent(now_, 4);
  EXPECT_TRUE(link_.repetition_due(now_ + settings_.repeat_interval_min));
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
