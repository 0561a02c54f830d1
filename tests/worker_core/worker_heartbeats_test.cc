// How often a worker says that it is there: ever more seldom, the more workers its learners hear.
#include <gmock/gmock.h>

#include "common/protocol/pieces.h"
#include "common/protocol/timings.h"
#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::heartbeats_of;
using protocol::WorkerStatus;

void greet(Stage& stage, protocol::LearnerId learner = kLearner) {
  stage.step(MessageReceived{protocol::RolloutBatch{learner, ++stage.sequence, {}, {{kMe, 0, 0}}}});
}

void say(Stage& stage, int num_workers, protocol::LearnerId learner = kLearner) {
  protocol::LearnerStatus status;
  status.learner_id = learner;
  status.num_workers = num_workers;
  stage.step(MessageReceived{status});
}

/// Heartbeats within so many seconds, in which each of these learners says once a second how many
/// workers it hears.
std::size_t num_beats(Stage& stage, int num_seconds,
                      const std::vector<std::pair<protocol::LearnerId, int>>& learners) {
  stage.clear();
  for (int i = 0; i < num_seconds; ++i) {
    for (const auto& [learner, num_workers] : learners) say(stage, num_workers, learner);
    stage.pass(1s);
  }
  return stage.sent<WorkerStatus>().size();
}

TEST(WorkerHeartbeatsTest, AmongFewWorkersItBeatsAsUsual) {
  Stage stage;
  greet(stage);
  EXPECT_EQ(num_beats(stage, 10, {{kLearner, 64}}), 40U);
}

TEST(WorkerHeartbeatsTest, SendsHeartbeatsMoreOftenWhileItHoldsRollouts) {
  Stage stage;
  EXPECT_THAT(stage.sent<WorkerStatus>(), ::testing::SizeIs(2)) << "at start, and once it has room";
  stage.clear();
  stage.pass(1s);
  EXPECT_THAT(stage.sent<WorkerStatus>(), ::testing::SizeIs(4));
  stage.define();
  stage.ask({stage.request(1)});
  stage.clear();
  stage.pass(1s);
  EXPECT_THAT(stage.sent<WorkerStatus>(), ::testing::SizeIs(10));
}

TEST(WorkerHeartbeatsTest, AmongThousandsItBeatsAsSeldomAsTheyAre) {
  Stage stage;
  greet(stage);
  EXPECT_LE(num_beats(stage, 64, {{kLearner, 4096}}), 11U);  // 6.4 s between two
}

TEST(WorkerHeartbeatsTest, TheLearnerThatHearsTheFewestDecides) {
  Stage stage;
  greet(stage);
  greet(stage, 2);
  EXPECT_GE(num_beats(stage, 10, {{kLearner, 4096}, {2, 3}}), 39U);
}

TEST(WorkerHeartbeatsTest, ALearnerThatHasNotSaidHowManyItHearsHearsFew) {
  Stage stage;
  greet(stage);
  EXPECT_LE(num_beats(stage, 10, {{kLearner, 4096}}), 3U);
  greet(stage, 2);
  EXPECT_GE(num_beats(stage, 1, {{kLearner, 4096}}), 3U);
  num_beats(stage, 2, {{kLearner, 4096}});
  EXPECT_LE(num_beats(stage, 10, {{kLearner, 4096}}), 3U)
      << "one that never says it, as treeroll-doctor, makes nobody loud";
}

TEST(WorkerHeartbeatsTest, ItBeatsSoonerAsSoonAsItIsToldThatTheyAreFewer) {
  Stage stage;
  greet(stage);
  num_beats(stage, 10, {{kLearner, 4096}});
  EXPECT_GE(num_beats(stage, 10, {{kLearner, 1}}), 39U);
}

TEST(WorkerHeartbeatsTest, WithoutALearnerItKeepsTheLastPaceAndOneThatIsHeardWakesIt) {
  Stage stage;
  greet(stage);
  num_beats(stage, 1, {{kLearner, 4096}});
  EXPECT_LE(num_beats(stage, 640, {}), 101U) << "thousands that nobody hears need not be loud";
  stage.clear();
  say(stage, 0, 2);  // whose first words did not come
  stage.pass(protocol::kIdleHeartbeat);
  EXPECT_EQ(stage.sent<WorkerStatus>().size(), 1U);
}

/// All workers of a large group hear what somebody plays from a recording, or makes up.
TEST(WorkerHeartbeatsTest, LearnersThatAreNotServedWakeItSeldom) {
  Stage stage;
  greet(stage);
  num_beats(stage, 1, {{kLearner, 4096}});
  stage.clear();
  for (int i = 0; i < 4 * 64; ++i) {
    if (i % 4 == 0) say(stage, 4096);
    say(stage, 0, 2);
    const protocol::LearnerId made_up = 100 + i;
    stage.step(MessageReceived{protocol::definition_piece(
        made_up, {protocol::DefinitionKind::kTask, content_hash("a task")}, "a task", 0)});
    stage.step(InboxDrained{});
    stage.pass(250ms);
  }
  EXPECT_LE(stage.sent<WorkerStatus>().size(), 64 / 6.4 + 64 / 25.6 + 2);
}

/// One that starts should not have to wait, be it the second within a second.
TEST(WorkerHeartbeatsTest, AmongFewWorkersEachLearnerThatStartsWakesItAtOnce) {
  Stage stage;
  for (const protocol::LearnerId learner : {2, 3, 4}) {
    stage.pass(260ms);
    stage.clear();
    stage.step(MessageReceived{protocol::definition_piece(
        learner, {protocol::DefinitionKind::kTask, content_hash("a task")}, "a task", 0)});
    stage.step(InboxDrained{});
    EXPECT_EQ(stage.sent<WorkerStatus>().size(), 1U);
  }
}

TEST(WorkerHeartbeatsTest, ALearnerThatIsGoneHoldsNobodyToItsNumber) {
  Stage stage;
  greet(stage);
  greet(stage, 2);
  num_beats(stage, 1, {{kLearner, 1}, {2, 4096}});
  num_beats(stage, 20, {{2, 4096}});  // the first one has been silent for more than 12 s
  EXPECT_LE(num_beats(stage, 20, {{2, 4096}}), 4U);
}

TEST(WorkerHeartbeatsTest, WhatItsLearnerDoubtsItSaysAtOnce) {
  Stage stage;
  stage.define();
  greet(stage);
  num_beats(stage, 10, {{kLearner, 4096}});
  stage.ask({stage.request(1)});
  say(stage, 4096);
  stage.clear();
  stage.ask({stage.request(1, 1)});  // whether it came, its learner does not know
  stage.pass(protocol::kBusyHeartbeat);
  ASSERT_EQ(stage.sent<WorkerStatus>().size(), 1U);
  EXPECT_EQ(stage.sent<WorkerStatus>()[0].held[0].keys.size(), 1U);
  stage.clear();
  greet(stage);  // whether it hears, its learner does not know
  stage.pass(protocol::kBusyHeartbeat);
  ASSERT_EQ(stage.sent<WorkerStatus>().size(), 1U);
  EXPECT_EQ(stage.sent<WorkerStatus>()[0].held[0].last_batch, stage.sequence);
}

}  // namespace
}  // namespace treeroll::worker
