#include <gmock/gmock.h>

#include "tests/worker_core/stage.h"

// A worker whose evaluators cannot start, or are killed again and again by others: what it holds
// must not wait for them while other workers idle, and nothing it was kept from is anybody's fault.
namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using protocol::WorkerStatus;
using ::testing::Each;
using ::testing::Field;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<protocol::RolloutKey> held(const WorkerStatus& status) {
  std::vector<protocol::RolloutKey> keys;
  for (const auto& of_learner : status.held) {
    keys.insert(keys.end(), of_learner.keys.begin(), of_learner.keys.end());
  }
  return keys;
}

TEST(WorkerTroubleTest, HasNoRoomUntilAnEvaluatorIsReadyAndSaysAtOnceThatItHas) {
  Stage stage;
  stage.evaluators_start = false;
  stage.die(0, Death::kExited, 1);
  EXPECT_EQ(stage.status().free_slots, 0);
  stage.define();
  stage.ask({stage.request(1)});
  EXPECT_THAT(held(stage.status()), IsEmpty()) << "it takes what it cannot evaluate";
  stage.clear();
  stage.step(EvaluatorReady{0});
  ASSERT_THAT(stage.sent<WorkerStatus>(), SizeIs(1));
  EXPECT_EQ(stage.sent<WorkerStatus>()[0].free_slots, 64);
}

TEST(WorkerTroubleTest, OneLivingEvaluatorIsEnoughToHaveRoom) {
  Stage stage(2);
  stage.evaluators_start = false;
  for (int i = 0; i < 5; ++i) {
    stage.die(0, Death::kForeignSignal);
    stage.pass(1s);
  }
  EXPECT_EQ(stage.status().free_slots, 128);
}

TEST(WorkerTroubleTest, ADeathOrTwoAreNoReasonToGiveARolloutUpWhileAnotherEvaluatorLives) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  stage.die(0, Death::kForeignSignal);
  stage.die(0, Death::kForeignSignal);
  EXPECT_THAT(held(stage.status()), SizeIs(2));
  stage.finish(0, .25);
  EXPECT_EQ(stage.sent<RewardBatch>().back().results.back().outcome.reward(), .25);
}

TEST(WorkerTroubleTest, GivesAllItHoldsUpAtOnceWhenEveryEvaluatorHasDiedTwiceForNothing) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1), stage.request(2), stage.request(3), stage.request(4)});
  stage.evaluators_start = false;
  for (int i = 0; i < 2; ++i) {
    stage.die(0, Death::kForeignSignal);
    EXPECT_THAT(held(stage.status()), SizeIs(4));
    stage.clear();
    stage.die(1, Death::kForeignSignal);
  }
  ASSERT_THAT(stage.sent<WorkerStatus>(), SizeIs(1)) << "the learner waits for the next heartbeat";
  const WorkerStatus status = stage.sent<WorkerStatus>()[0];
  EXPECT_THAT(held(status), IsEmpty());
  EXPECT_EQ(status.free_slots, 0);
  EXPECT_EQ(status.held.at(0).last_batch, 1);
  stage.clear();
  stage.pass(1min - 10s);
  EXPECT_THAT(stage.sent<WorkerStatus>(), Each(Field(&WorkerStatus::free_slots, 0)));
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty()) << "a kill by others is no roll-out's fault";
}

TEST(WorkerTroubleTest, EvaluatorsThatLoadAndAreKilledAtTheirRolloutCountAsTrouble) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.die(0, Death::kForeignSignal);
  EXPECT_EQ(stage.runs().size(), 2U) << "once is an accident";
  stage.die(0, Death::kForeignSignal);
  EXPECT_THAT(held(stage.status()), IsEmpty());
  EXPECT_EQ(stage.status().num_failed, 0);
}

TEST(WorkerTroubleTest, WhatIsGivenUpInTroubleIsTakenFromWhoWasKilledButHasNotEndedYet) {
  Stage stage(2);
  stage.define();
  stage.die(1, Death::kForeignSignal);
  stage.evaluators_start = false;
  stage.die(1, Death::kForeignSignal);
  stage.evaluators_start = true;
  stage.die(0, Death::kForeignSignal);
  stage.evaluators_start = false;
  stage.die(0, Death::kForeignSignal);
  stage.step(EvaluatorReady{0});
  stage.pass(10ms);
  stage.step(EvaluatorReady{0});
  stage.ask({stage.request(1)});
  ASSERT_EQ(stage.running(0).key.number, 1);
  stage.cpu_time = 1h;
  stage.pass(3s);
  ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
  stage.die(1, Death::kForeignSignal);
  EXPECT_THAT(held(stage.status()), IsEmpty());
  stage.die(0, Death::kForeignSignal);
  EXPECT_THAT(held(stage.status()), IsEmpty());
  EXPECT_EQ(stage.status().num_failed, 0);
}

TEST(WorkerTroubleTest, GivesUpARolloutUnderWhichThreeHaveBeenKilledAndKeepsTheOthers) {
  Stage stage(8);
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  ASSERT_EQ(stage.running(0).key.number, 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(held(stage.status()), SizeIs(2));
    const Stage::Run last = stage.runs().front();
    ASSERT_EQ(last.request.key.number, 1);
    stage.clear();
    stage.die(last.evaluator, Death::kForeignSignal);
  }
  ASSERT_THAT(stage.sent<WorkerStatus>(), SizeIs(1));
  EXPECT_EQ(held(stage.sent<WorkerStatus>()[0]), (std::vector<protocol::RolloutKey>{{0, 2}}));
  EXPECT_EQ(stage.sent<WorkerStatus>()[0].num_failed, 0);
  // Nobody else has it evaluated: it comes again, and counts anew.
  stage.ask({stage.request(1, 1)});
  stage.finish(stage.runs().back().evaluator, .75);
  EXPECT_EQ(stage.sent<RewardBatch>().back().results.back().outcome.reward(), .75);
}

TEST(WorkerTroubleTest, OnlyWhoChecksADefinitionSettlesIt) {
  for (const Death death : {Death::kForeignSignal, Death::kFatalSignal}) {
    Stage stage(2, [](WorkerSettings& s) { s.num_tasks_max = 1; });
    const std::string other = "another task";
    const auto comes = [&](const std::string& content) { stage.step(task(content)); };
    const auto loaded = [&](int evaluator, const std::string& task) {
      stage.step(DefinitionLoaded{
          evaluator, {DefinitionKind::kTask, content_hash(task)}, true, "", stage.task_facts});
    };
    stage.define();
    stage.ask({stage.request(1)});
    stage.definitions_load = false;
    stage.ask({stage.request(2)});  // evaluator 1 loads the task for it
    auto changed = stage.request(2, 0, 6);
    changed.task_id = content_hash("a task that never comes");
    stage.ask({changed});
    stage.finish(0);
    comes(other);  // the first is evicted
    loaded(0, other);
    comes(kTask);  // evaluator 0 checks it
    ASSERT_EQ(stage.effects<LoadDefinition>().back().evaluator, 0);
    stage.clear();
    loaded(1, kTask);
    EXPECT_THAT(stage.sent<protocol::DefinitionReport>(), IsEmpty());
    comes(other);
    stage.definitions_load = true;
    stage.die(0, death);
    ASSERT_THAT(stage.sent<protocol::DefinitionReport>(), SizeIs(1));
    EXPECT_EQ(stage.sent<protocol::DefinitionReport>()[0].definition_id, content_hash(kTask));
    EXPECT_TRUE(stage.sent<protocol::DefinitionReport>()[0].accepted);
  }
}

TEST(WorkerTroubleTest, TimeInWhichTheWorkerItselfWasStoppedIsNobodysFault) {
  for (const bool hears_first : {false, true}) {
    Stage stage;
    stage.define();
    stage.ask({stage.request(1)});
    for (int i = 0; i < 5; ++i) {
      stage.pass(600ms);
      // Ctrl-Z. No timer is served, which shows from the next heartbeat on: 100 ms are not seen.
      stage.now += 10s;
      if (hears_first) stage.ask({stage.request(1)});
      stage.pass({});
      EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
    }
    stage.pass(400ms);
    ASSERT_THAT(stage.effects<KillEvaluator>(), IsEmpty()) << "4 s may pass, and 3.9 have at most";
    stage.finish(0, .5);
    EXPECT_EQ(stage.sent<RewardBatch>().back().results.back().outcome.status(), RolloutStatus::kOk);
  }
}

TEST(WorkerTroubleTest, OneThatIsBlockedIsFoundNoLaterForTheTimeTheWorkerRuns) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.pass(2s);
  stage.now += 20s;
  stage.pass({});
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.pass(3s);  // 2 x 2 s + 1 s, and 20 s that do not count
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
}

TEST(WorkerTroubleTest, NorIsAStartLateForItsSake) {
  Stage stage;
  stage.evaluators_start = false;
  stage.die(0, Death::kForeignSignal);
  stage.now += 1h;
  stage.pass(29s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.pass(2s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
}

}  // namespace
}  // namespace treeroll::worker
