#include <gmock/gmock.h>
#include <malloc.h>

#include <set>
#include <string>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::DefinitionReport;
using protocol::DefinitionRequest;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(WorkerDefinitionsTest, ReportsWhatAnEvaluatorSaysOfATaskAndOfAPolicyOnlyBadNews) {
  Stage stage;
  stage.define();
  const auto reports = stage.sent<DefinitionReport>();
  ASSERT_THAT(reports, SizeIs(1));
  EXPECT_EQ(reports[0].definition_id, content_hash(kTask));
  EXPECT_EQ(reports[0].learner_id, kLearner);
  EXPECT_TRUE(reports[0].accepted);
  EXPECT_EQ(reports[0].text, "described");
  stage.clear();
  stage.refusal = "cannot be read";
  stage.step(policy("another policy"));
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_FALSE(stage.sent<DefinitionReport>()[0].accepted);
}

TEST(WorkerDefinitionsTest, ReportsAKnownDefinitionAgainWithoutLoadingItAgain) {
  Stage stage;
  stage.define();
  stage.clear();
  stage.define(2);
  EXPECT_THAT(stage.effects<LoadDefinition>(), IsEmpty());
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_EQ(stage.sent<DefinitionReport>()[0].learner_id, 2);
}

TEST(WorkerDefinitionsTest, AsksForWhatItLacksAndEvaluatesOnceItIsThere) {
  Stage stage;
  stage.ask({stage.request(1), stage.request(2)});
  ASSERT_THAT(stage.sent<DefinitionRequest>(), SizeIs(1));
  const DefinitionRequest request = stage.sent<DefinitionRequest>()[0];
  EXPECT_EQ(request.learner_id, kLearner);
  EXPECT_THAT(request.definitions, ElementsAre(protocol::WantedDefinition{task_name(), {}},
                                               protocol::WantedDefinition{policy_name(), {}}));
  stage.ask({stage.request(3)});
  EXPECT_THAT(stage.sent<DefinitionRequest>(), SizeIs(1)) << "asked for a moment ago";
  EXPECT_EQ(stage.status().free_slots, 61) << "they are held meanwhile";
  stage.define();
  EXPECT_EQ(stage.running(0).key.number, 1);
  stage.clear();
  stage.pass(10s);
  EXPECT_THAT(stage.sent<DefinitionRequest>(), IsEmpty());
}

TEST(WorkerDefinitionsTest, AsksAgainEverMoreSeldomAndLetsGoAfterThirtySeconds) {
  Stage stage;
  stage.ask({stage.request(1)});
  stage.pass(1s);
  EXPECT_THAT(stage.sent<DefinitionRequest>(), SizeIs(23)) << "after 5, 10, 20, 40, 50, 50, ... ms";
  stage.pass(29s);
  stage.clear();
  EXPECT_THAT(stage.status().held.at(0).keys, IsEmpty());
  EXPECT_THAT(stage.sent<DefinitionRequest>(), IsEmpty());
}

TEST(WorkerDefinitionsTest, AsksAtOnceForADefinitionItHasNotAskedFor) {
  Stage stage;
  stage.ask({stage.request(1)});
  auto other = stage.request(2);
  other.policy_id = content_hash("another policy");
  stage.ask({other});
  EXPECT_THAT(stage.sent<DefinitionRequest>(), SizeIs(2));
}

/// Anybody can send tasks that take a second each to check.
TEST(WorkerDefinitionsTest, WhatNoRolloutWaitsForHasAFifthOfAnEvaluatorsTime) {
  Stage stage;
  stage.define();
  stage.ask_for(40);
  stage.definitions_load = false;
  for (int i = 0; i < 20; ++i) stage.step(task("stranger's task " + std::to_string(i), 666));
  stage.clear();
  const TimePoint start = stage.now;
  bool evaluates = true;
  while (stage.now < start + 10s) {
    stage.now += evaluates ? 500ms : 1000ms;
    const std::size_t num_loads = stage.effects<LoadDefinition>().size();
    if (evaluates) {
      stage.finish(0);
    } else {
      const DefinitionName name = stage.effects<LoadDefinition>().back().name;
      stage.step(DefinitionLoaded{0, name, false, "no", {}});
    }
    evaluates = stage.effects<LoadDefinition>().size() == num_loads;
  }
  EXPECT_LE(stage.effects<LoadDefinition>().size(), 3U);
  EXPECT_GE(stage.effects<LoadDefinition>().size(), 2U);
  EXPECT_GE(stage.runs().size(), 14U);
}

/// A study begins, or a layer is switched: all roll-outs wait for what has yet to be checked,
/// behind a stranger's.
TEST(WorkerDefinitionsTest, WhatRolloutsWaitForIsCheckedBesideWhatAStrangerHasSent) {
  Stage stage(4);
  stage.definitions_load = false;
  for (int i = 0; i < 20; ++i) stage.step(task("stranger's task " + std::to_string(i), 666));
  EXPECT_THAT(stage.effects<LoadDefinition>(), SizeIs(1)) << "one evaluator, also while all idle";
  stage.ask({stage.request(1)});
  stage.define();
  std::set<DefinitionName> loaded;
  for (const LoadDefinition& load : stage.effects<LoadDefinition>()) loaded.insert(load.name);
  EXPECT_TRUE(loaded.contains(task_name()));
  EXPECT_TRUE(loaded.contains(policy_name()));
  EXPECT_EQ(loaded.size(), 3U);
}

TEST(WorkerDefinitionsTest, DoesNotBelieveAnIdThatIsNotTheContentsHash) {
  Stage stage;
  stage.step(MessageReceived{protocol::definition_piece(kLearner, task_name(), "other", 0)});
  EXPECT_THAT(stage.effects<LoadDefinition>(), IsEmpty());
  EXPECT_THAT(stage.sent<DefinitionReport>(), IsEmpty());
  EXPECT_EQ(stage.status().num_rejected, 1);
}

TEST(WorkerDefinitionsTest, LetsGoOfRolloutsUnderARefusedDefinitionAndSaysWhy) {
  Stage stage;
  stage.refusal = "task.gravity = -1: must be above 0";
  stage.ask({stage.request(1)});
  stage.define();
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(2));
  EXPECT_FALSE(stage.sent<DefinitionReport>()[0].accepted);
  EXPECT_EQ(stage.sent<DefinitionReport>()[0].text, stage.refusal);
  EXPECT_THAT(stage.status().held.at(0).keys, IsEmpty());
  stage.clear();
  stage.ask({stage.request(2), stage.request(3)});
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1)) << "one a definition and turn";
  EXPECT_FALSE(stage.sent<DefinitionReport>()[0].accepted);
  EXPECT_THAT(stage.status().held.at(0).keys, IsEmpty());
  EXPECT_THAT(stage.sent<DefinitionRequest>(), IsEmpty());
}

TEST(WorkerDefinitionsTest, RefusesAPolicyWithOtherDimensionsThanItsTask) {
  Stage stage;
  stage.policy_facts.output_dim = 2;
  stage.define();
  stage.clear();
  stage.ask({stage.request(1)});
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_EQ(stage.sent<DefinitionReport>()[0].definition_id, content_hash(kPolicy));
  EXPECT_EQ(stage.sent<DefinitionReport>()[0].text,
            "the policy has 1 inputs and 2 outputs, the task takes 1 and 1");
  EXPECT_THAT(stage.runs(), IsEmpty());
}

TEST(WorkerDefinitionsTest, ARefusalStandsWhereBothAreReportedInOneTurn) {
  Stage stage;
  stage.policy_facts.output_dim = 2;
  stage.define();
  stage.clear();
  stage.give(MessageReceived{protocol::RolloutBatch{kLearner, 1, {stage.request(1)}, {}}});
  stage.give(policy(kPolicy));
  stage.step(InboxDrained{});
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_FALSE(stage.sent<DefinitionReport>()[0].accepted);
}

TEST(WorkerDefinitionsTest, RefusesAThetaOfAnotherSize) {
  Stage stage;
  stage.define();
  stage.clear();
  auto request = stage.request(1);
  request.theta = {1, 2, 3};
  stage.ask({request});
  EXPECT_THAT(stage.sent<DefinitionReport>().at(0).text, HasSubstr("theta of 2 numbers"));
  EXPECT_THAT(stage.runs(), IsEmpty());
}

TEST(WorkerDefinitionsTest, RefusesADefinitionThatEndsThreeEvaluators) {
  Stage stage;
  stage.definitions_load = false;
  stage.step(task(kTask));
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(stage.sent<DefinitionReport>(), IsEmpty());
    stage.die(0, Death::kFatalSignal, 11);
  }
  ASSERT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
  EXPECT_THAT(stage.sent<DefinitionReport>()[0].text, HasSubstr("crashed 3 evaluators"));
}

TEST(WorkerDefinitionsTest, RefusesADefinitionThatHangsThreeEvaluators) {
  Stage stage;
  stage.definitions_load = false;
  stage.step(task(kTask));
  stage.cpu_time = 11s;
  for (int i = 0; i < 3; ++i) {
    stage.clear();
    stage.pass(11s);
    ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
    stage.die(0, Death::kForeignSignal, 9);
  }
  EXPECT_THAT(stage.sent<DefinitionReport>().at(0).text, HasSubstr("took too long"));
}

TEST(WorkerDefinitionsTest, ADefinitionWhoseEvaluatorWasKilledIsLoadedByTheNext) {
  Stage stage;
  stage.definitions_load = false;
  stage.step(task(kTask));
  for (int i = 0; i < 5; ++i) {
    stage.die(0, Death::kForeignSignal, 9);
    stage.pass(1s);
  }
  EXPECT_THAT(stage.sent<DefinitionReport>(), IsEmpty());
  stage.definitions_load = true;
  stage.die(0, Death::kForeignSignal, 9);
  stage.pass(1s);
  EXPECT_THAT(stage.sent<DefinitionReport>(), SizeIs(1));
}

TEST(WorkerDefinitionsTest, GivesEachEvaluatorADefinitionOnceAndEachNewProcessAgain) {
  Stage stage(2);
  stage.define();
  EXPECT_THAT(stage.effects<LoadDefinition>(), SizeIs(2)) << "checked by one";
  stage.ask({stage.request(1), stage.request(2)});
  EXPECT_THAT(stage.effects<LoadDefinition>(), SizeIs(4)) << "loaded by the other";
  stage.finish(0);
  stage.finish(1);
  stage.ask({stage.request(3), stage.request(4)});
  EXPECT_THAT(stage.effects<LoadDefinition>(), SizeIs(4));
  stage.die(1, Death::kForeignSignal);
  EXPECT_THAT(stage.effects<LoadDefinition>(), SizeIs(6));
}

TEST(WorkerDefinitionsTest, TellsEvaluatorsToForgetWhatItHasDroppedItself) {
  Stage stage(1, [](WorkerSettings& s) { s.num_policies_max = 2; });
  for (const char* content : {"p1", "p2", "p3", "p4"}) {
    stage.step(policy(content));
  }
  stage.define();
  std::vector<ContentHash> forgotten;
  for (const auto& forget : stage.effects<ForgetDefinition>()) forgotten.push_back(forget.name.id);
  EXPECT_THAT(forgotten, testing::UnorderedElementsAre(content_hash("p1"), content_hash("p2"),
                                                       content_hash("p3")));
}

TEST(WorkerDefinitionsTest, AFloodOfThemWhileNoEvaluatorIsIdleDoesNotMakeItGrow) {
  const auto heap_bytes = [] { return mallinfo2().uordblks + mallinfo2().hblkhd; };
  if (heap_bytes() == 0) GTEST_SKIP() << "this allocator does not count: a sanitizer's";
  Stage stage(1, [](WorkerSettings& s) { s.num_policies_max = 50; });
  stage.define();
  stage.ask({stage.request(1)});
  std::size_t warm_bytes = 0;
  for (int i = 0; i < 60'000; ++i) {
    const std::string content = std::to_string(i);
    stage.step(policy(content));
    stage.clear();
    if (i == 20'000) warm_bytes = heap_bytes();
  }
  EXPECT_LE(heap_bytes(), warm_bytes + (128U << 10U));
  stage.finish(0);  // and those that are still here are looked at, each once
  EXPECT_LE(stage.effects<LoadDefinition>().size(), 50U);
  EXPECT_GE(stage.effects<LoadDefinition>().size(), 40U);
}

TEST(WorkerDefinitionsTest, AsManyReportsAsATurnMayHaveAndTheOthersWhenAskedAgain) {
  Stage stage;
  stage.refusal = "no";
  std::vector<ContentHash> tasks;
  for (int i = 0; i < 20; ++i) {
    const std::string content = "task " + std::to_string(i);
    tasks.push_back(content_hash(std::string_view(content)));
    stage.step(task(content));
  }
  const auto ask_for_all = [&] {
    stage.clear();
    for (protocol::LearnerId learner = 1; learner <= 64; ++learner) {
      protocol::RolloutBatch batch{learner, ++stage.sequence, {}, {}};
      for (std::size_t i = 0; i < tasks.size(); ++i) {
        batch.rollouts.push_back(stage.request(static_cast<int>(i)));
        batch.rollouts.back().task_id = tasks[i];
      }
      stage.give(MessageReceived{batch});
    }
    stage.give(InboxDrained{});
    return stage.sent<DefinitionReport>();
  };
  EXPECT_THAT(ask_for_all(), SizeIs(protocol::kReportsPerTurnMax));
  EXPECT_THAT(ask_for_all(), SizeIs(protocol::kReportsPerTurnMax));
}

TEST(WorkerDefinitionsTest, KeepsADefinitionInUseHoweverManyOthersArrive) {
  Stage stage(1, [](WorkerSettings& s) { s.num_policies_max = 2; });
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  for (const char* content : {"p1", "p2", "p3", "p4"}) {
    stage.step(policy(content));
  }
  stage.finish(0);
  stage.finish(0);
  EXPECT_EQ(stage.sent<protocol::RewardBatch>().size(), 2U);
  EXPECT_THAT(stage.sent<DefinitionRequest>(), IsEmpty());
}

}  // namespace
}  // namespace treeroll::worker
