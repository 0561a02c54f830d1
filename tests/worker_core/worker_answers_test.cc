#include <gmock/gmock.h>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(WorkerAnswersTest, EvaluatesARolloutAndAnswersOnce) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(7, 2, 99)});
  EXPECT_EQ(stage.running(0).key.number, 7);
  stage.clear();
  stage.finish(0, .25);
  const auto batches = stage.sent<RewardBatch>();
  ASSERT_THAT(batches, SizeIs(1));
  EXPECT_EQ(batches[0].worker_id, kMe);
  EXPECT_EQ(batches[0].learner_id, kLearner);
  EXPECT_EQ(batches[0].last_batch, 1);
  EXPECT_EQ(batches[0].first_index, 1);
  EXPECT_EQ(batches[0].free_slots, 64);
  EXPECT_EQ(batches[0].oldest_index, 1);
  EXPECT_EQ(batches[0].batches_received, 1);
  ASSERT_THAT(batches[0].results, SizeIs(1));
  const protocol::RolloutResult expected{
      .key = {0, 7}, .attempt = 2, .content = 99, .outcome = Outcome::ok(.25), .duration_ns = 1000};
  EXPECT_EQ(batches[0].results[0], expected);
}

TEST(WorkerAnswersTest, TakesOnlyWhatIsAskedOfIt) {
  Stage stage;
  stage.define();
  auto other = stage.request(1);
  other.worker_id = kMe + 1;
  stage.ask({other});
  EXPECT_THAT(stage.runs(), IsEmpty());
}

TEST(WorkerAnswersTest, GathersTheAnswersOfATurnInOneBatch) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.give(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1});
  stage.give(RolloutEvaluated{1, stage.job(1), {.5, RolloutStatus::kOk}, 1});
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
  stage.step(InboxDrained{});
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_THAT(stage.sent<RewardBatch>()[0].results, SizeIs(2));
}

TEST(WorkerAnswersTest, DoesNotQueueAHeldRolloutTwiceAndAnswersUnderTheLatestAttempt) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1, 0)});
  stage.ask({stage.request(1, 1)});
  stage.ask({stage.request(1, 1)});
  EXPECT_THAT(stage.runs(), SizeIs(1));
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().back().results.at(0).attempt, 1);
  EXPECT_THAT(stage.runs(), SizeIs(1));
}

TEST(WorkerAnswersTest, AnswersARepeatedRequestFromItsStore) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.finish(0, .75);
  stage.acknowledge(1);
  stage.clear();
  stage.ask({stage.request(1, 3)});
  EXPECT_THAT(stage.runs(), IsEmpty());
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  const RewardBatch batch = stage.sent<RewardBatch>()[0];
  EXPECT_EQ(batch.first_index, 2);
  EXPECT_EQ(batch.results.at(0).attempt, 3);
  EXPECT_EQ(batch.results.at(0).outcome.reward(), .75);
  EXPECT_EQ(stage.status().num_repeated, 1);
}

TEST(WorkerAnswersTest, AnotherContentReplacesTheHeldQuestionEvenWhileItRuns) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1, 0, 10)});
  stage.ask({stage.request(1, 0, 11)});
  stage.finish(0, .1);  // the older question: nobody wants it any more
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
  EXPECT_EQ(stage.running(0).content, 11);
  stage.finish(0, .2);
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_EQ(stage.sent<RewardBatch>()[0].results.at(0).content, 11);
}

TEST(WorkerAnswersTest, AnOlderQuestionThatWasOvertakenDoesNotReplaceTheNewer) {
  Stage stage;
  stage.define();
  stage.sequence = 10;
  stage.ask({stage.request(1, 0, 11)});
  stage.sequence = 4;
  stage.ask({stage.request(1, 0, 10)});
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().at(0).results.at(0).content, 11);
  EXPECT_EQ(stage.sent<RewardBatch>().at(0).last_batch, 11);
  EXPECT_THAT(stage.runs(), SizeIs(1));
}

TEST(WorkerAnswersTest, SaysWhichOfTheLastBatchesHaveCome) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.sequence = 4;  // three are lost
  stage.ask({stage.request(2)});
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().back().last_batch, 5);
  EXPECT_EQ(stage.sent<RewardBatch>().back().batches_received, 0b10001);
  stage.sequence = 2;  // one of them was only late
  stage.ask({});
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().back().last_batch, 5);
  EXPECT_EQ(stage.sent<RewardBatch>().back().batches_received, 0b10101);
}

TEST(WorkerAnswersTest, ItsStatusFollowsAllAnswersThatItDoesNotHoldAnyMore) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.clear();
  stage.now += 250ms;
  stage.give(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1});
  stage.give(TimerFired{});
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  const auto& effects = stage.effects<SendMessage>();
  EXPECT_TRUE(std::holds_alternative<RewardBatch>(effects.at(0).message));
  EXPECT_TRUE(std::holds_alternative<protocol::WorkerStatus>(effects.at(1).message));
}

TEST(WorkerAnswersTest, AnswersWithLongReasonsKeepToTheByteBudgetToo) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  const Outcome failed =
      Outcome::failed(RolloutStatus::kFailed, std::string(kOutcomeReasonBytesMax, 'x'));
  for (int i = 0; i < 20; ++i) {
    stage.ask({stage.request(i)});
    stage.give(RolloutEvaluated{0, stage.job(0), failed, 1});
    stage.step(InboxDrained{});
  }
  stage.clear();
  stage.pass(3ms);
  const RewardBatch last = stage.sent<RewardBatch>().at(0);
  EXPECT_EQ(last.results.front().outcome, failed);
  EXPECT_GE(last.results.size(), 3U);
  EXPECT_LE(bytes_of(last), protocol::kBatchBytesRemoteMax);
  EXPECT_EQ(stage.status().num_failed, 20);
}

TEST(WorkerAnswersTest, ADiscardedTrialIsAnAnswerAndItsRepetitionIsSimulated) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(7, 0, 99)});
  stage.give(RolloutEvaluated{0, stage.job(0), Outcome::discarded("caught"), 1});
  stage.step(InboxDrained{});
  EXPECT_EQ(stage.sent<RewardBatch>().back().results.back().outcome, Outcome::discarded("caught"));
  EXPECT_EQ(stage.status().num_failed, 0);
  // The next trial has another seed, and so another content: the store must not answer it.
  stage.clear();
  stage.ask({stage.request(7, 0, 100)});
  EXPECT_THAT(stage.runs(), SizeIs(1));
  stage.finish(0, .5);
  EXPECT_EQ(stage.sent<RewardBatch>().back().results.back().outcome, Outcome::ok(.5));
}

TEST(WorkerAnswersTest, GathersAnswersWhileItHasWorkForLongAndNotWhenItRunsDry) {
  Stage stage;
  stage.define();
  stage.ask_for(60);
  stage.clear();
  stage.work(1ms);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(1)) << "how soon more could come is not known yet";
  stage.pass(100us);
  stage.see(1);
  stage.clear();
  for (int i = 0; i < 40; ++i) stage.work(1ms);
  stage.pass(protocol::kAnswerDelayMax);
  EXPECT_GE(stage.sent<RewardBatch>().size(), 5U) << "8 ms at most";
  EXPECT_LE(stage.sent<RewardBatch>().size(), 9U);
  stage.see(41);
  stage.clear();
  while (stage.status().free_slots < 62) stage.work(1ms);
  stage.clear();
  stage.work(1ms);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(1)) << "few are queued";
  stage.work(1ms);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(2));
}

TEST(WorkerAnswersTest, SaysAtOnceThatABatchWasLostWhereItRunsDry) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.finish(0);
  stage.clear();
  stage.sequence += 1;
  stage.see(1);
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_THAT(stage.sent<RewardBatch>()[0].results, IsEmpty());
  EXPECT_EQ(stage.sent<RewardBatch>()[0].batches_received, 0b101);
  stage.see(1);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(1)) << "once";
}

TEST(WorkerAnswersTest, DropsWhatDoesNotFitAndReportsItsFreeSlots) {
  Stage stage(1, [](WorkerSettings& s) { s.held_per_evaluator_max = 3; });
  stage.define();
  EXPECT_EQ(stage.status().free_slots, 3);
  stage.ask({stage.request(1), stage.request(2), stage.request(3), stage.request(4)});
  const auto status = stage.status();
  EXPECT_EQ(status.free_slots, 0);
  ASSERT_THAT(status.held, SizeIs(1));
  EXPECT_EQ(status.held[0].learner_id, kLearner);
  EXPECT_EQ(status.held[0].last_batch, 1);
  EXPECT_EQ(status.held[0].keys, (std::vector<protocol::RolloutKey>{{0, 1}, {0, 2}, {0, 3}}));
  stage.finish(0);
  EXPECT_EQ(stage.sent<RewardBatch>().back().free_slots, 1);
}

}  // namespace
}  // namespace treeroll::worker
