#include <gmock/gmock.h>

#include <set>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Stretches = std::vector<std::pair<std::int64_t, std::int64_t>>;

/// Indices of the results of each batch sent since the last clear(): first and last.
Stretches stretches(const Stage& stage) {
  Stretches all;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) {
    const auto num_results = static_cast<std::int64_t>(batch.results.size());
    all.emplace_back(batch.first_index, batch.first_index + num_results - 1);
  }
  return all;
}

TEST(WorkerRepetitionsTest, RepeatsUnacknowledgedAnswersEverMoreSeldom) {
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

TEST(WorkerRepetitionsTest, SendsEachAnswerOnceAndRepeatsOnlyWhatHasNotBeenSeen) {
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

TEST(WorkerRepetitionsTest, AsksForTheWordThatAnswersAreOnStableStorageByRepeatingThem) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.finish(0);
  stage.finish(0);
  stage.see(2);
  stage.clear();
  stage.pass(protocol::kSettleIntervalMin);
  EXPECT_EQ(stretches(stage), (Stretches{{1, 2}})) << "the word may have been lost";
  stage.pass(2 * protocol::kSettleIntervalMin);
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(2)) << "ever more seldom";
  stage.acknowledge(2);
  stage.clear();
  stage.pass(5s);
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
}

TEST(WorkerRepetitionsTest, AllThatIsAskedAgainComesAgainHoweverSmallAFrame) {
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

TEST(WorkerRepetitionsTest, AnAnswerThatWaitsIsNotSettledByAnIndexThatWasNeverGiven) {
  Stage stage;
  stage.define();
  stage.ask_for(60);
  stage.work(1ms);
  stage.pass(100us);
  stage.see(1);
  stage.clear();
  stage.work(1ms);
  ASSERT_THAT(stage.sent<RewardBatch>(), IsEmpty()) << "it waits for others to go along with";
  stage.acknowledge(1'000'000);
  stage.pass(protocol::kAnswerDelayMax + 1ms);
  EXPECT_EQ(stretches(stage), (Stretches{{2, 2}}));
}

TEST(WorkerRepetitionsTest, NewAnswersWaitForNoAcknowledgementHoweverSmallAFrame) {
  Stage stage(1, [](WorkerSettings& s) { s.batch_bytes_max = protocol::kBatchBytesRemoteMax; });
  stage.define();
  for (int i = 0; i < 60; ++i) {
    stage.ask({stage.request(i)});
    stage.finish(0);
  }
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(60));
  EXPECT_EQ(stretches(stage).back(), std::pair(std::int64_t{60}, std::int64_t{60}));
}

TEST(WorkerRepetitionsTest, RepeatsInAFewFramesAtATimeWhatHasBeenMissed) {
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
    EXPECT_LE(bytes_of(batch), protocol::kBatchBytesRemoteMax);
  }
  stage.see(repeated.back().second);
  stage.clear();
  stage.pass(3ms);
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(4)) << "at once after a word that moves them";
  EXPECT_EQ(stage.sent<RewardBatch>()[0].first_index, repeated.back().second + 1);
}

TEST(WorkerRepetitionsTest, AQuestionThatComesAgainBringsItsAnswerAgainAtOnce) {
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

TEST(WorkerRepetitionsTest, GathersNothingWhereMessagesAreLost) {
  Stage stage;
  stage.define();
  stage.ask_for(60);
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

}  // namespace
}  // namespace treeroll::worker
