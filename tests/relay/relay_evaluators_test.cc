// Which workers below make the room that a relay has above.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/relay/relay_stage.h"

namespace treeroll::relay {
namespace {

using protocol::WorkerStatus;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(RelayEvaluatorsTest, WithoutWorkersItGivesItsWorkBackAndHasNoRoom) {
  RelayStage stage;
  stage.add_worker(1, 1h);
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1});
  stage.pass(1s);
  stage.remove_worker(0);
  stage.pass(10s);
  const WorkerStatus status = stage.above<WorkerStatus>().back();
  EXPECT_EQ(status.num_evaluators, 0);
  EXPECT_EQ(status.free_slots, 0);
  ASSERT_THAT(status.held, SizeIs(1));
  EXPECT_THAT(status.held[0].keys, IsEmpty()) << "else they would be kept from all others";
  stage.add_worker(2);
  stage.pass(1s);
  stage.ask({0, 1});
  stage.pass(1s);
  EXPECT_THAT(stage.results(), SizeIs(2));
}

TEST(RelayEvaluatorsTest, WithWorkersThatDoNotHearItGivesItsWorkBackAndHasNoRoom) {
  RelayStage stage;
  stage.add_worker(1);
  stage.pass(1s);
  stage.below_is_deaf = true;
  stage.define();
  stage.ask({0, 1});
  EXPECT_THAT(stage.above<WorkerStatus>().back().held.at(0).keys, SizeIs(2));
  stage.pass(10s);
  const WorkerStatus status = stage.above<WorkerStatus>().back();
  EXPECT_EQ(status.free_slots, 0);
  EXPECT_THAT(status.held.at(0).keys, IsEmpty()) << "else they would be kept from all others";
  EXPECT_TRUE(stage.logs("no worker can be given roll-outs"));
  stage.below_is_deaf = false;
  stage.pass(10s);
  EXPECT_GT(stage.above<WorkerStatus>().back().free_slots, 0);
  stage.ask({0, 1});
  stage.pass(1s);
  EXPECT_THAT(stage.results(), SizeIs(2));
}

/// A learner believes a relay what it says of its workers.
TEST(RelayEvaluatorsTest, CountsNoEvaluatorsOfAWorkerThatDoesNotHearBesideOneThatDoes) {
  RelayStage stage;
  stage.add_worker(1);
  stage.add_deaf_worker(2).num_evaluators = 63;
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1});
  stage.pass(3s);
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 1);
  EXPECT_THAT(stage.results(), SizeIs(2));
}

TEST(RelayEvaluatorsTest, AWorkersEvaluatorsCountAsItsAnswersShowThem) {
  RelayStage stage;
  stage.add_worker(1, 10ms).num_evaluators = 40;
  stage.pass(1s);
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 16) << "it has answered nothing";
  stage.define();
  stage.ask({0});
  stage.pass(500ms);
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 32);
  stage.ask({1});
  stage.pass(500ms);
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 40);
  stage.learner_speaks = false;
  stage.pass(70s);  // it has gone
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 40) << "and what it has shown stays";
}

/// Else made-up names would push the workers out of the relay's table, the first heard first.
TEST(RelayEvaluatorsTest, ThousandsOfMadeUpWorkersBelowPushNobodyOut) {
  RelayStage stage;
  stage.add_worker(1, 1s);
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(200ms);
  protocol::WorkerStatus made_up = stage.worker(0).status(0);
  for (std::size_t i = 0; i < 2 * protocol::kWorkersMax; ++i) {
    made_up.worker_id = 10'000 + static_cast<protocol::WorkerId>(i);
    stage.hear(made_up);
  }
  // With no status of its own in between, its answer is taken.
  stage.hear(stage.worker(0).finish(stage.learner_of(0), stage.now));
  EXPECT_THAT(stage.results(), SizeIs(1));
}

}  // namespace
}  // namespace treeroll::relay
