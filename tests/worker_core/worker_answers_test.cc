#include <gmock/gmock.h>

#include <set>

#include "common/protocol/wire_sizes.h"
#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// What a batch takes on the wire.
std::size_t transport_bytes(const RewardBatch& batch) {
  std::size_t bytes = protocol::kFrameBytesMax + protocol::kRewardBatchBytes;
  for (const protocol::RolloutResult& result : batch.results) {
    bytes += protocol::rollout_result_bytes(result.outcome.reason().size());
  }
  return bytes;
}

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

TEST(WorkerAnswersTest, RepeatsUnacknowledgedAnswersEverMoreSeldom) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.finish(0);
  stage.clear();
  const TimePoint start = stage.now;
  std::vector<Duration> times;
  while (stage.now < start + 5s) {
    stage.pass(1ms);
    for (std::size_t i = 0; i < stage.sent<RewardBatch>().size(); ++i) {
      times.push_back(stage.now - start);
    }
    stage.clear();
  }
  EXPECT_EQ(times, (std::vector<Duration>{3ms, 9ms, 21ms, 45ms, 93ms, 189ms, 381ms, 765ms, 1533ms,
                                          2533ms, 3533ms, 4533ms}));
  stage.acknowledge(1);
  stage.pass(10s);
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
}

/// Indices of the results of each batch sent since the last clear(): first and last.
std::vector<std::pair<std::int64_t, std::int64_t>> stretches(const Stage& stage) {
  std::vector<std::pair<std::int64_t, std::int64_t>> all;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) {
    const auto num_results = static_cast<std::int64_t>(batch.results.size());
    all.emplace_back(batch.first_index, batch.first_index + num_results - 1);
  }
  return all;
}
using Stretches = std::vector<std::pair<std::int64_t, std::int64_t>>;

TEST(WorkerAnswersTest, SendsEachAnswerOnceAndRepeatsOnlyWhatHasNotBeenSeen) {
  Stage stage;
  stage.define();
  for (int i = 1; i <= 3; ++i) {
    stage.ask({stage.request(i)});
    stage.finish(0);
  }
  EXPECT_EQ(stretches(stage), (Stretches{{1, 1}, {2, 2}, {3, 3}}));
  stage.clear();
  stage.see(2);
  stage.pass(3ms);
  EXPECT_EQ(stretches(stage), (Stretches{{3, 3}}));
  EXPECT_EQ(stage.sent<RewardBatch>().back().oldest_index, 1) << "none is on stable storage";
  stage.see(3);
  stage.clear();
  stage.pass(90ms);
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
}

TEST(WorkerAnswersTest, AsksForTheWordThatAnswersAreOnStableStorageByRepeatingThem) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.finish(0);
  stage.finish(0);
  stage.see(2);
  stage.clear();
  stage.pass(100ms);
  EXPECT_EQ(stretches(stage), (Stretches{{1, 2}})) << "the word may have been lost";
  stage.pass(200ms);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(2)) << "ever more seldom";
  stage.acknowledge(2);
  stage.clear();
  stage.pass(5s);
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
}

TEST(WorkerAnswersTest, AllThatIsAskedAgainComesAgainHoweverSmallAFrame) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  std::vector<protocol::RolloutRequest> requests;
  for (int i = 0; i < 60; ++i) {
    requests.push_back(stage.request(i));
    stage.ask({requests.back()});
    stage.finish(0);
  }
  stage.see(60);
  stage.clear();
  stage.ask(requests);
  std::set<std::int64_t> again;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) {
    for (std::size_t i = 0; i < batch.results.size(); ++i) {
      again.insert(batch.first_index + static_cast<std::int64_t>(i));
    }
  }
  EXPECT_THAT(again, SizeIs(60));
}

TEST(WorkerAnswersTest, AnAnswerThatWaitsIsNotSettledByAnIndexThatWasNeverGiven) {
  Stage stage;
  stage.define();
  std::vector<protocol::RolloutRequest> requests;
  for (int i = 0; i < 60; ++i) requests.push_back(stage.request(i));
  stage.ask(requests);
  const auto finish = [&stage] {
    stage.pass(1ms);
    stage.step(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1'000'000});
  };
  finish();
  stage.pass(100us);
  stage.see(1);
  stage.clear();
  finish();
  ASSERT_THAT(stage.sent<RewardBatch>(), IsEmpty()) << "it waits for others to go along with";
  stage.acknowledge(1'000'000);
  stage.pass(5ms);
  EXPECT_EQ(stretches(stage), (Stretches{{2, 2}}));
}

TEST(WorkerAnswersTest, NewAnswersWaitForNoAcknowledgementHoweverSmallAFrame) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  for (int i = 0; i < 60; ++i) {
    stage.ask({stage.request(i)});
    stage.finish(0);
  }
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(60));
  EXPECT_EQ(stretches(stage).back(), std::pair(std::int64_t{60}, std::int64_t{60}));
}

TEST(WorkerAnswersTest, RepeatsInAFewFramesAtATimeWhatHasBeenMissed) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  for (int i = 0; i < 500; ++i) {
    stage.ask({stage.request(i)});
    stage.give(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1});
    stage.step(InboxDrained{});
  }
  stage.pass(5s);
  stage.clear();
  stage.pass(1s);
  const Stretches repeated = stretches(stage);
  ASSERT_THAT(repeated, SizeIs(4));
  EXPECT_EQ(repeated[0].first, 1);
  for (std::size_t i = 1; i < repeated.size(); ++i) {
    EXPECT_EQ(repeated[i].first, repeated[i - 1].second + 1);
    EXPECT_GE(repeated[i].second - repeated[i].first, 15);
  }
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) {
    EXPECT_LE(transport_bytes(batch), protocol::kBatchBytesRemoteMax);
  }
  stage.see(repeated.back().second);
  stage.clear();
  stage.pass(3ms);
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(4)) << "at once after a word that moves them";
  EXPECT_EQ(stage.sent<RewardBatch>()[0].first_index, repeated.back().second + 1);
}

TEST(WorkerAnswersTest, AQuestionThatComesAgainBringsItsAnswerAgainAtOnce) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1), stage.request(2), stage.request(3)});
  for (int i = 0; i < 3; ++i) stage.finish(0);
  stage.see(3);
  stage.clear();
  stage.ask({stage.request(2, 1)});
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_EQ(stage.sent<RewardBatch>()[0].first_index, 2);
  EXPECT_EQ(stage.sent<RewardBatch>()[0].results[0].attempt, 1);
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
  EXPECT_LE(transport_bytes(last), protocol::kBatchBytesRemoteMax);
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
  std::vector<protocol::RolloutRequest> requests;
  for (int i = 0; i < 60; ++i) requests.push_back(stage.request(i));
  stage.ask(requests);
  const auto finish = [&stage] {
    stage.pass(1ms);
    stage.step(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1'000'000});
  };
  stage.clear();
  finish();
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(1)) << "how soon more could come is not known yet";
  stage.pass(100us);
  stage.see(1);
  stage.clear();
  for (int i = 0; i < 40; ++i) finish();
  stage.pass(4ms);
  EXPECT_GE(stage.sent<RewardBatch>().size(), 8U) << "4 ms at most";
  EXPECT_LE(stage.sent<RewardBatch>().size(), 14U);
  stage.see(41);
  stage.clear();
  while (stage.status().free_slots < 62) finish();
  stage.clear();
  finish();
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(1)) << "few are queued";
  finish();
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(2));
}

TEST(WorkerAnswersTest, GathersNothingWhereMessagesAreLost) {
  Stage stage;
  stage.define();
  std::vector<protocol::RolloutRequest> requests;
  for (int i = 0; i < 60; ++i) requests.push_back(stage.request(i));
  stage.ask(requests);
  stage.finish(0);
  stage.see(1);
  stage.sequence += 3;
  stage.ask({});
  stage.clear();
  for (int i = 0; i < 5; ++i) {
    stage.step(RolloutEvaluated{0, stage.job(0), {.5, RolloutStatus::kOk}, 1'000'000});
  }
  const Stretches sent = stretches(stage);
  EXPECT_EQ(sent, (Stretches{{2, 2}, {2, 3}, {2, 4}, {2, 5}, {2, 6}}))
      << "and all that has not been seen goes along";
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

TEST(WorkerAnswersTest, ServesTwoLearnersInTurn) {
  Stage stage;
  stage.define(1);
  stage.ask({stage.request(1), stage.request(2), stage.request(3), stage.request(4)}, 1);
  stage.ask({stage.request(1), stage.request(2)}, 2);
  for (int i = 0; i < 6; ++i) stage.finish(0);
  std::vector<protocol::LearnerId> order;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) order.push_back(batch.learner_id);
  EXPECT_EQ(order, (std::vector<protocol::LearnerId>{1, 2, 1, 2, 1, 1}));
}

TEST(WorkerAnswersTest, ForgetsALearnerThatHasBeenSilentForAMinute) {
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

TEST(WorkerAnswersTest, GivesUpTheWorkOfALearnerThatIsGoneAndEndsTheEvaluatorsThatDoIt) {
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

TEST(WorkerAnswersTest, SaysAtOnceThatItHearsALearnerThatStartsOrGreetsIt) {
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

TEST(WorkerAnswersTest, DoesNothingThatARecordingOfAForgottenLearnerAsks) {
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

TEST(WorkerAnswersTest, ALearnersStatusIsAWordToo) {
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

TEST(WorkerAnswersTest, KeepsSixtyFourLearnersAndForgetsTheMostSilentIdleOne) {
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

TEST(WorkerAnswersTest, SendsHeartbeatsMoreOftenWhileItHoldsRollouts) {
  Stage stage;
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>(), SizeIs(2)) << "at start, and once it has room";
  stage.clear();
  stage.pass(1s);
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>(), SizeIs(4));
  stage.define();
  stage.ask({stage.request(1)});
  stage.clear();
  stage.pass(1s);
  EXPECT_THAT(stage.sent<protocol::WorkerStatus>(), SizeIs(10));
}

}  // namespace
}  // namespace treeroll::worker
