#include <gmock/gmock.h>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using protocol::WorkerStatus;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(WorkerDrainTest, AnIdleWorkerSaysGoodbyeAndLeaves) {
  Stage stage;
  stage.clear();
  stage.step(DrainRequested{});
  ASSERT_THAT(stage.effects<Exit>(), SizeIs(1));
  EXPECT_EQ(stage.effects<Exit>()[0].status, 0);
  const auto status = stage.sent<WorkerStatus>();
  ASSERT_FALSE(status.empty());
  EXPECT_TRUE(status.front().draining);
  EXPECT_EQ(status.back().free_slots, 0);
}

TEST(WorkerDrainTest, FinishesWhatRunsDropsWhatWaitsAndTakesNoMore) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1), stage.request(2), stage.request(3)});
  stage.clear();
  stage.step(DrainRequested{});
  EXPECT_EQ(stage.sent<WorkerStatus>().at(0).held.at(0).keys,
            (std::vector<protocol::RolloutKey>{{0, 1}, {0, 2}}));
  stage.ask({stage.request(4)});
  stage.finish(0);
  stage.finish(1);
  EXPECT_THAT(stage.runs(), IsEmpty());
  EXPECT_THAT(stage.sent<RewardBatch>(), SizeIs(2));
  EXPECT_THAT(stage.effects<Exit>(), IsEmpty()) << "until its answers are acknowledged";
  stage.acknowledge(2);
  ASSERT_THAT(stage.effects<Exit>(), SizeIs(1));
  EXPECT_EQ(stage.effects<Exit>()[0].status, 0);
  EXPECT_TRUE(stage.sent<WorkerStatus>().back().draining);
}

TEST(WorkerDrainTest, WaitsForAcknowledgementsFiveSecondsAtMostAndRepeatsMeanwhile) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.step(DrainRequested{});
  stage.pass(1s);
  stage.finish(0);
  stage.clear();
  stage.pass(4999ms);
  EXPECT_THAT(stage.effects<Exit>(), IsEmpty());
  EXPECT_GE(stage.sent<RewardBatch>().size(), 5U);
  stage.pass(1ms);
  EXPECT_THAT(stage.effects<Exit>(), SizeIs(1));
}

TEST(WorkerDrainTest, GivesUpWhatDoesNotEndInAMinute) {
  Stage stage;
  stage.task_facts.time_limit = 3600s;
  stage.define();
  stage.ask({stage.request(1)});
  stage.step(DrainRequested{});
  stage.pass_heard(59s);
  EXPECT_THAT(stage.effects<Exit>(), IsEmpty());
  stage.pass(1s);
  ASSERT_THAT(stage.effects<Exit>(), SizeIs(1));
  EXPECT_EQ(stage.effects<Exit>()[0].status, 0);
  const WorkerStatus last = stage.sent<WorkerStatus>().back();
  for (const auto& held : last.held) {
    EXPECT_THAT(held.keys, IsEmpty());
  }
}

TEST(WorkerDrainTest, AnswersARepeatedRequestWhileItDrains) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.finish(0);
  stage.acknowledge(1);
  stage.step(DrainRequested{});
  stage.clear();
  stage.ask({stage.request(1, 1)});
  ASSERT_THAT(stage.sent<RewardBatch>(), SizeIs(1));
  EXPECT_EQ(stage.sent<RewardBatch>()[0].free_slots, 0);
}

TEST(WorkerDrainTest, DoesNotRestartADeadEvaluatorNorRetryItsRollout) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.step(DrainRequested{});
  stage.clear();
  stage.die(0, Death::kForeignSignal);
  EXPECT_THAT(stage.effects<StartEvaluator>(), IsEmpty());
  EXPECT_THAT(stage.effects<Exit>(), SizeIs(1));
}

TEST(WorkerDrainTest, LeavesAtOnceWhenAskedTwiceAndDoesNothingAfterwards) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.step(DrainRequested{});
  stage.step(DrainRequested{});
  ASSERT_THAT(stage.effects<Exit>(), SizeIs(1));
  EXPECT_EQ(stage.effects<Exit>()[0].status, 1);
  EXPECT_TRUE(std::holds_alternative<Exit>(stage.all_effects().back()));
  stage.pass(100s);
  EXPECT_TRUE(std::holds_alternative<Exit>(stage.all_effects().back()));
}

TEST(WorkerDrainTest, LeavesByItselfAfterItHasHeldNothingForAsLongAsItIsTold) {
  Stage stage(1, [](WorkerSettings& settings) { settings.idle_max = 30s; });
  stage.define();
  stage.pass_heard(20s);
  stage.ask({stage.request(1)});
  stage.pass_heard(100s);  // a long one
  stage.finish(0);
  stage.acknowledge(1);
  stage.pass_heard(29s);
  EXPECT_THAT(stage.effects<Exit>(), IsEmpty());
  stage.pass(2s);
  ASSERT_THAT(stage.effects<Exit>(), SizeIs(1));
  EXPECT_EQ(stage.effects<Exit>()[0].status, 0);
  EXPECT_TRUE(stage.sent<WorkerStatus>().back().draining);
}

}  // namespace
}  // namespace treeroll::worker
