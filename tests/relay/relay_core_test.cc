#include "workers/relay/relay_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/relay/relay_stage.h"

namespace treeroll::relay {
namespace {

using protocol::DefinitionReport;
using protocol::RolloutBatch;
using protocol::WorkerStatus;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(RelayCoreTest, IsNoWorkerBeforeAWorkerIsHeardAndThenOneWithAllEvaluators) {
  RelayStage stage;
  stage.pass(2s);
  EXPECT_THAT(stage.above<WorkerStatus>(), IsEmpty());
  stage.add_worker(1);
  stage.add_worker(2);
  stage.pass(2s);
  const WorkerStatus status = stage.above<WorkerStatus>().back();
  EXPECT_EQ(status.worker_id, kRelay);
  EXPECT_EQ(status.numeric_class, "class");
  EXPECT_EQ(status.num_evaluators, 2);
  EXPECT_EQ(status.free_slots, 2 * protocol::kHeldPerEvaluatorMax);
}

TEST(RelayCoreTest, PassesRolloutsDownUnderTheirNamesAndAnswersUp) {
  RelayStage stage;
  stage.add_worker(1);
  stage.add_worker(2);
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1, -2, 3, 4});
  stage.pass(1s);
  const auto results = stage.results();
  ASSERT_THAT(results, SizeIs(5));
  EXPECT_EQ(results.at(3).content, 103);
  EXPECT_EQ(results.at(3).outcome.reward(), learner::bump({.1 * 3, 0}));
  int num_asked = 0;
  for (const RolloutBatch& batch : stage.below<RolloutBatch>()) {
    EXPECT_NE(batch.learner_id, kLearner) << "below it is a learner of its own";
    for (const auto& request : batch.rollouts) {
      ++num_asked;
      EXPECT_EQ(request.content, 100 + request.key.number);
    }
  }
  EXPECT_EQ(num_asked, 5);
  EXPECT_TRUE(stage.above<DefinitionReport>().at(0).accepted);
  EXPECT_EQ(stage.above<DefinitionReport>().at(0).text,
            to_json(*task_description_from_json(learner::kDescription)).dump());
}

TEST(RelayCoreTest, NamesWhatIsBelowAsHeldUntilItIsAnswered) {
  RelayStage stage;
  stage.add_worker(1, 3s);
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1});
  stage.pass(2s);
  ASSERT_THAT(stage.above<WorkerStatus>().back().held, SizeIs(1));
  EXPECT_THAT(stage.above<WorkerStatus>().back().held[0].keys, SizeIs(2));
  stage.pass(2s);
  EXPECT_THAT(stage.above<WorkerStatus>().back().held[0].keys, SizeIs(1));
}

TEST(RelayCoreTest, AnotherWorkerBelowTakesOverAndTheLearnerNeverKnows) {
  RelayStage stage;
  stage.add_worker(1, 1h);
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1});
  stage.pass(1s);
  stage.add_worker(2);
  stage.pass(1s);
  stage.remove_worker(0);
  stage.pass(10s);
  EXPECT_THAT(stage.results(), SizeIs(2));
}

TEST(RelayCoreTest, MixesNoClassesAndSaysWhoIsLeftOut) {
  RelayStage stage;
  stage.add_worker(1);
  stage.pass(1s);
  learner::FakeWorker& other = stage.add_worker(2);
  other.numeric_class = "other";
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1, 2, 3, 4, 5});
  stage.pass(5s);
  EXPECT_THAT(stage.results(), SizeIs(6));
  EXPECT_EQ(other.num_requests, 0);
  EXPECT_EQ(stage.above<WorkerStatus>().back().num_evaluators, 1);
  EXPECT_TRUE(
      stage.logs("gets no roll-outs: it is of numeric class other, this relay serves class"));
}

TEST(RelayCoreTest, ServesTheClassItIsToldTo) {
  RelayStage stage("other");
  stage.add_worker(1);
  learner::FakeWorker& other = stage.add_worker(2);
  other.numeric_class = "other";
  stage.pass(1s);
  EXPECT_EQ(stage.above<WorkerStatus>().back().numeric_class, "other");
  stage.define();
  stage.ask({0});
  stage.pass(1s);
  EXPECT_EQ(other.num_evaluated, 1);
}

TEST(RelayCoreTest, ATaskThatAllRefuseIsRefusedWithTheirReasonAndAskedAboutAgain) {
  RelayStage stage;
  learner::FakeWorker& worker = stage.add_worker(1);
  worker.refusal = "no such task here";
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(3s);
  ASSERT_FALSE(stage.above<DefinitionReport>().empty());
  EXPECT_FALSE(stage.above<DefinitionReport>().back().accepted);
  EXPECT_THAT(stage.above<DefinitionReport>().back().text, HasSubstr("no such task here"));
  EXPECT_THAT(stage.above<WorkerStatus>().back().held.at(0).keys, IsEmpty());
  // Another program takes its place: what was refused is not refused for ever.
  stage.remove_worker(0);
  stage.add_worker(2);
  stage.pass(65s);
  stage.define();
  stage.ask({0});
  stage.pass(2s);
  EXPECT_THAT(stage.results(), SizeIs(1));
}

/// One made-up worker below would else decide for ever what the relay says of a task.
TEST(RelayCoreTest, WhatMostWorkersBelowSayOfATaskReplacesWhatTheFirstOneSaid) {
  RelayStage stage;
  learner::FakeWorker& first = stage.add_worker(1, 1h);
  first.description =
      R"({"deterministic":true,"input_dim":1,"output_dim":1,"reward_max":9.0,"reward_min":0.0,"time_limit_s":10.0})";
  stage.pass(1s);
  stage.define();
  stage.pass(1s);
  ASSERT_THAT(stage.above<DefinitionReport>(), SizeIs(1));
  EXPECT_THAT(stage.above<DefinitionReport>().back().text, HasSubstr("9.0"));
  stage.add_worker(2);
  stage.add_worker(3);
  stage.pass(1s);
  stage.ask({0, 1, 2, 3, 4, 5});  // for these they ask what the task is
  stage.pass(2s);
  EXPECT_TRUE(stage.above<DefinitionReport>().back().accepted);
  EXPECT_THAT(stage.above<DefinitionReport>().back().text, HasSubstr("\"reward_max\":1.0"));
}

TEST(RelayCoreTest, AWorkerBelowWithARewardOutOfRangeIsDistrustedThere) {
  RelayStage stage;
  stage.add_worker(1).reward_factor = 1000;
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(1s);
  EXPECT_THAT(stage.results(), IsEmpty()) << "else the learner would distrust the whole rack";
  EXPECT_TRUE(stage.logs("outside the task's range"));
  stage.pass(2s);
  const WorkerStatus status = stage.above<WorkerStatus>().back();
  EXPECT_EQ(status.free_slots, 0);
  EXPECT_THAT(status.held.at(0).keys, IsEmpty()) << "others of the learner's may have it";
  stage.add_worker(2);
  stage.pass(2s);
  stage.ask({0});
  stage.pass(1s);
  EXPECT_THAT(stage.results(), SizeIs(1));
}

TEST(RelayCoreTest, FailuresAndVoidTrialsPassWithTheirReasons) {
  RelayStage stage;
  learner::FakeWorker& worker = stage.add_worker(1);
  worker.result_status = RolloutStatus::kDiverged;
  worker.reward_factor = 0;
  worker.reason = "it fell";
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(1s);
  EXPECT_EQ(stage.results().at(0).outcome.status(), RolloutStatus::kDiverged);
  EXPECT_EQ(stage.results().at(0).outcome.reason(), "it fell");
  worker.discards_one_in = 1;
  stage.ask({1});
  stage.pass(1s);
  EXPECT_TRUE(stage.results().at(1).outcome.is_discarded());
}

TEST(RelayCoreTest, TellsTheWorkersOfItsLearnersLifeAndNumberOfWorkers) {
  RelayStage stage;
  stage.add_worker(1);
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(3s);
  ASSERT_FALSE(stage.below<protocol::LearnerStatus>().empty());
  const auto status = stage.below<protocol::LearnerStatus>().back();
  EXPECT_EQ(status.num_workers, 1);
  EXPECT_EQ(status.study, "study");
  EXPECT_EQ(status.learner_id, stage.below<RolloutBatch>().back().learner_id);
  stage.learner_speaks = false;
  stage.clear();
  stage.pass(10s);
  EXPECT_THAT(stage.below<protocol::LearnerStatus>(), IsEmpty()) << "its silence goes down too";
}

TEST(RelayCoreTest, TwoLearnersAreTwoBelow) {
  RelayStage stage;
  stage.add_worker(1);
  stage.pass(1s);
  stage.define(1);
  stage.define(2);
  stage.ask({0}, 1);
  stage.pass(1s);
  const protocol::LearnerId first = stage.below<RolloutBatch>().back().learner_id;
  stage.clear();
  stage.ask({0}, 2);
  stage.pass(1s);
  EXPECT_NE(stage.below<RolloutBatch>().back().learner_id, first);
}

TEST(RelayCoreTest, AskedToEndItFinishesWhatHasBegunAndGivesTheRestBack) {
  RelayStage stage;
  stage.add_worker(1, 1s);
  stage.pass(1s);
  stage.define();
  stage.ask({0, 1, 2, 3, 4, 5, 6, 7});  // of which the worker gets two at first
  stage.pass(100ms);
  stage.drain();
  EXPECT_TRUE(stage.above<WorkerStatus>().back().draining);
  stage.pass(5s);
  EXPECT_THAT(stage.results(), SizeIs(2));
  stage.say(RolloutBatch{kLearner, 2, {}, {{kRelay, 2, 2}}});
  EXPECT_THAT(stage.exits, ElementsAre(0));
}

TEST(RelayCoreTest, AskedTwiceItEndsAtOnce) {
  RelayStage stage;
  stage.add_worker(1, 1s);
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(100ms);
  stage.drain();
  stage.drain();
  EXPECT_THAT(stage.exits, ElementsAre(1));
}

TEST(RelayCoreTest, AQuestionThatReplacesAnotherIsTheOneThatIsAnswered) {
  RelayStage stage;
  stage.add_worker(1, 1s);
  stage.pass(1s);
  stage.define();
  stage.ask({0});
  stage.pass(100ms);
  RolloutBatch other{kLearner, 2, {}, {}};
  other.rollouts.push_back({.worker_id = kRelay,
                            .key = {.run = 0, .number = 0},
                            .attempt = 1,
                            .content = 999,
                            .task_id = content_hash(kTask),
                            .policy_id = content_hash(kPolicy),
                            .theta = {.7, 0}});
  stage.say(other);
  stage.pass(20s);
  ASSERT_THAT(stage.results(), SizeIs(1));
  EXPECT_EQ(stage.results().at(0).content, 999);
}

/// A learner above that keeps every worker busy: each answer is followed by a roll-out.
TEST(RelayCoreTest, AnswersOfARackGoUpTogether) {
  RelayStage stage;
  constexpr int kWorkers = 100;
  for (int id = 1; id <= kWorkers; ++id) {
    stage.add_worker(id, 20ms + std::chrono::microseconds(137 * id));
  }
  stage.pass(1s);
  stage.define();
  int num_asked = 0;
  const auto ask = [&](int count) {
    std::vector<int> numbers;
    for (int i = 0; i < count; ++i) numbers.push_back(num_asked++);
    stage.ask(numbers);
  };
  ask(2 * kWorkers);
  stage.pass(100ms);
  stage.clear();
  stage.spent = {};
  std::int64_t num_results = 0;
  std::int64_t num_messages = 0;
  std::int64_t last_index = 0;
  while (num_results < 10'000) {
    stage.pass(1ms);
    int num_new = 0;
    for (const auto& batch : stage.above<protocol::RewardBatch>()) {
      ++num_messages;
      num_new += static_cast<int>(batch.results.size());
      last_index = batch.first_index + std::ssize(batch.results) - 1;
    }
    stage.clear();
    if (num_new == 0) continue;
    num_results += num_new;
    ask(num_new);
    stage.acknowledge(last_index);
  }
  std::printf("  %.1f results a message up, %.1f us a roll-out in the relay's core\n",
              static_cast<double>(num_results) / static_cast<double>(num_messages),
              to_seconds(stage.spent) * 1e6 / static_cast<double>(num_results));
  EXPECT_GE(num_results, 4 * num_messages);
}

}  // namespace
}  // namespace treeroll::relay
