#include <gmock/gmock.h>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(WorkerLearnersTest, ServesTwoLearnersInTurn) {
  Stage stage;
  stage.define(1);
  stage.ask({stage.request(1), stage.request(2), stage.request(3), stage.request(4)}, 1);
  stage.ask({stage.request(1), stage.request(2)}, 2);
  for (int i = 0; i < 6; ++i) stage.finish(0);
  std::vector<protocol::LearnerId> order;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) order.push_back(batch.learner_id);
  EXPECT_EQ(order, (std::vector<protocol::LearnerId>{1, 2, 1, 2, 1, 1}));
}

TEST(WorkerLearnersTest, ForgetsALearnerThatHasBeenSilentForAMinute) {
  Stage stage;
  stage.task_facts.time_limit = 1000s;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.finish(0);
  stage.pass(61s);
  stage.die(0, Death::kForeignSignal);  // it had roll-out 2, nobody's now
  stage.clear();
  const auto status = stage.status();
  EXPECT_THAT(status.held, IsEmpty());
  EXPECT_EQ(status.free_slots, 64);
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
  // Back again, it is asked anew, and its indices go on.
  stage.ask({stage.request(1)});
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().at(0).first_index, 2);
}

TEST(WorkerLearnersTest, GivesUpTheWorkOfALearnerThatIsGoneAndEndsTheEvaluatorsThatDoIt) {
  Stage stage(2);
  stage.task_facts.time_limit = 1000s;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.ask({stage.request(3)}, 2);  // another learner waits for an evaluator
  stage.pass(11s);
  stage.step(MessageReceived{protocol::RolloutBatch{2, 2, {}, {}}});
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.pass(2s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(2));
  const auto held = stage.status().held;
  ASSERT_THAT(held, SizeIs(2)) << "its answers are kept yet";
  EXPECT_THAT(held[0].keys, IsEmpty());
  EXPECT_THAT(held[1].keys, SizeIs(1));
  stage.clear();
  stage.die(0, Death::kForeignSignal);
  ASSERT_THAT(stage.runs(), SizeIs(1)) << "its evaluator is started at once";
  EXPECT_EQ(stage.runs()[0].request.key.number, 3);
}

TEST(WorkerLearnersTest, LetsEndWhatRunsAndIsNotRepeatableOfALearnerThatIsGone) {
  Stage stage;
  stage.task_facts.time_limit = 1000s;
  stage.task_facts.repeatable = false;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.pass(13s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty()) << "it may be a robot in motion";
  auto held = stage.status().held;
  ASSERT_THAT(held, SizeIs(1));
  ASSERT_THAT(held[0].keys, SizeIs(1)) << "nobody begins another trial";
  EXPECT_EQ(held[0].keys[0].number, 1);
  stage.pass(20s);
  stage.clear();
  stage.finish(0);
  EXPECT_THAT(stage.runs(), IsEmpty());
  stage.clear();
  stage.ask({stage.request(1)});  // the learner is heard again
  EXPECT_THAT(stage.runs(), IsEmpty());
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_EQ(stage.sent<RewardBatch>()[0].results.at(0).key.number, 1);
}

TEST(WorkerLearnersTest, BeginsNoTrialAnewForALearnerThatIsGone) {
  Stage stage;
  stage.task_facts.time_limit = 1000s;
  stage.task_facts.repeatable = false;
  stage.define();
  stage.ask({stage.request(1)});
  stage.pass(13s);
  stage.clear();
  stage.die(0, Death::kFatalSignal, 11);
  EXPECT_THAT(stage.runs(), IsEmpty());
  EXPECT_THAT(stage.status().held.at(0).keys, IsEmpty());
}

TEST(WorkerLearnersTest, SaysAtOnceThatItHearsALearnerThatStartsOrGreetsIt) {
  Stage stage;
  stage.clear();
  stage.step(task(kTask));
  ASSERT_THAT(stage.sent<protocol::WorkerStatus>(), SizeIs(1));
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>()[0].held, IsEmpty()) << "nobody has greeted it";
  stage.clear();
  stage.step(MessageReceived{protocol::RolloutBatch{kLearner, 7, {}, {{kMe + 1, 0, 0}}}});
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>(), IsEmpty()) << "another one was greeted";
  stage.step(MessageReceived{protocol::RolloutBatch{kLearner, 8, {}, {{kMe, 0, 0}}}});
  ASSERT_THAT(stage.sent<protocol::WorkerStatus>(), SizeIs(1));
  ASSERT_THAT(stage.sent<protocol::WorkerStatus>()[0].held, SizeIs(1));
  EXPECT_EQ(stage.sent<protocol::WorkerStatus>()[0].held[0].last_batch, 8);
  stage.clear();
  stage.step(MessageReceived{protocol::RolloutBatch{kLearner, 9, {}, {{kMe, 0, 0}}}});
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>(), IsEmpty()) << "the next heartbeat will do";
}

TEST(WorkerLearnersTest, DoesNothingThatARecordingOfAForgottenLearnerAsks) {
  Stage stage;
  stage.define();
  const protocol::RolloutBatch recorded{kLearner, 5, {stage.request(1)}, {}};
  stage.step(MessageReceived{recorded});
  stage.finish(0);
  stage.pass(61s);
  stage.clear();
  stage.step(MessageReceived{recorded});
  EXPECT_THAT(stage.runs(), IsEmpty());
  EXPECT_THAT(stage.status().held, IsEmpty());
  stage.sequence = 5;
  stage.ask({stage.request(1)});  // the learner itself, back again
  EXPECT_THAT(stage.runs(), SizeIs(1));
}

TEST(WorkerLearnersTest, ALearnersStatusIsAWordToo) {
  Stage stage;
  protocol::LearnerStatus word;
  word.learner_id = kLearner;
  stage.define();
  stage.ask({stage.request(1)});
  for (int i = 0; i < 100; ++i) {
    stage.pass(1s);
    stage.step(MessageReceived{word});
  }
  EXPECT_THAT(stage.status().held, SizeIs(1));
}

TEST(WorkerLearnersTest, KeepsSixtyFourLearnersAndForgetsTheMostSilentIdleOne) {
  Stage stage;
  stage.define();
  for (int learner = 1; learner <= 64; ++learner) {
    stage.ask({stage.request(1)}, learner);
    stage.pass(1ms);
  }
  stage.ask({stage.request(1)}, 65);  // all others hold roll-outs
  EXPECT_THAT(stage.status().held, SizeIs(64));
  stage.finish(0);  // learner 1's
  stage.ask({stage.request(1)}, 65);
  const auto held = stage.status().held;
  ASSERT_THAT(held, SizeIs(64));
  EXPECT_EQ(held.front().learner_id, 2);
  EXPECT_EQ(held.back().learner_id, 65);
}

}  // namespace
}  // namespace treeroll::worker
