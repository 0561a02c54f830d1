#include <gmock/gmock.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tests/worker_app/learner_stand_in.h"

/// The real worker over a multicast group of this host. Limits are generous, since a machine may
/// be busy; what is waited for comes in milliseconds.
namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::SizeIs;

struct Stage {
  explicit Stage(int salt, int num_evaluators = 1)
      : learner(salt),
        worker({"--processes=" + std::to_string(num_evaluators), "--lcm-url=" + learner.url()}) {}

  LearnerStandIn learner;
  Child worker;
};

TEST(WorkerProcessTest, EvaluatesAndAnswersEveryRolloutAndDrainsWithStatusZero) {
  Stage stage(1, 2);
  ASSERT_TRUE(stage.learner.meet_worker());
  EXPECT_EQ(stage.learner.status->num_evaluators, 2);
  EXPECT_EQ(stage.learner.status->pid, stage.worker.pid());
  EXPECT_GT(stage.learner.status->receive_buffer_bytes, 0);
  EXPECT_THAT(stage.learner.status->numeric_class, HasSubstr("glibc"));
  EXPECT_THAT(stage.learner.status->numeric_class, HasSubstr(" ode "));
  stage.learner.define(synthetic_task("{}"));
  stage.learner.ask(0, 100);
  ASSERT_TRUE(stage.learner.until([&] {
    for (int i = 0; i < 100; ++i) {
      if (stage.learner.result(i) == nullptr) return false;
    }
    return true;
  }));
  // The reward is a smooth function of theta with its maximum where the last number is 1.
  EXPECT_EQ(stage.learner.result(10)->outcome.status(), RolloutStatus::kOk);
  EXPECT_GT(stage.learner.result(10)->outcome.reward(), stage.learner.result(20)->outcome.reward());
  stage.learner.acknowledge();
  stage.worker.signal(SIGTERM);
  EXPECT_EQ(stage.worker.wait(), 0);
  EXPECT_TRUE(stage.learner.until([&] { return stage.learner.status->draining; }, 2s));
}

TEST(WorkerProcessTest, AsksForDefinitionsItMissed) {
  LearnerStandIn learner(2);
  learner.define(synthetic_task("{}"));  // before there is a worker
  const Child worker({"--processes=1", "--lcm-url=" + learner.url()});
  ASSERT_TRUE(learner.meet_worker());
  learner.ask(0, 1);
  ASSERT_TRUE(learner.until([&] { return !learner.requests.empty(); }));
  EXPECT_THAT(learner.requests[0].definitions, SizeIs(2));
  learner.define(synthetic_task("{}"));
  EXPECT_TRUE(learner.until([&] { return learner.result(0) != nullptr; }));
}

TEST(WorkerProcessTest, ReportsATaskItCannotMake) {
  Stage stage(3);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"duration_us": -1})"));
  ASSERT_TRUE(stage.learner.until([&] { return stage.learner.reports.size() == 1; }));
  EXPECT_FALSE(stage.learner.reports[0].accepted);
  EXPECT_THAT(stage.learner.reports[0].text, HasSubstr("task.duration_us = -1"));
}

TEST(WorkerProcessTest, RefusesAPolicyThatDoesNotFitItsTask) {
  Stage stage(4);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"output_dim": 2})"));
  stage.learner.ask(0, 1);
  const auto refused = [&] {
    return !stage.learner.reports.empty() && !stage.learner.reports.back().accepted;
  };
  ASSERT_TRUE(stage.learner.until(refused));
  EXPECT_THAT(stage.learner.reports.back().text,
              HasSubstr("the policy has 1 inputs and 1 outputs, the task takes 1 and 2"));
}

TEST(WorkerProcessTest, ReplacesAKilledEvaluatorAndAnswersItsRollout) {
  Stage stage(5, 2);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"mode": "sleep", "duration_us": 1000000})"));
  stage.learner.ask(0, 2);
  ASSERT_TRUE(stage.learner.until(
      [&] { return !stage.learner.status->held.empty() && stage.learner.reports.size() == 1; }));
  const auto evaluators = children_of(stage.worker.pid());
  ASSERT_THAT(evaluators, SizeIs(2));
  kill(evaluators[0], SIGKILL);
  ASSERT_TRUE(stage.learner.until(
      [&] { return stage.learner.result(0) != nullptr && stage.learner.result(1) != nullptr; }));
  EXPECT_EQ(stage.learner.result(0)->outcome.status(), RolloutStatus::kOk);
  EXPECT_EQ(stage.learner.result(1)->outcome.status(), RolloutStatus::kOk);
  EXPECT_TRUE(stage.learner.until([&] { return stage.learner.status->num_restarts == 1; }));
  EXPECT_FALSE(is_alive(evaluators[0]));
  EXPECT_THAT(children_of(stage.worker.pid()), SizeIs(2));
}

TEST(WorkerProcessTest, ARolloutThatCrashesItsEvaluatorsIsAnsweredAsCrashed) {
  Stage stage(6);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"crash_fraction": 1})"));
  stage.learner.ask(0, 2);
  ASSERT_TRUE(stage.learner.until(
      [&] { return stage.learner.result(0) != nullptr && stage.learner.result(1) != nullptr; }));
  EXPECT_EQ(stage.learner.result(0)->outcome.status(), RolloutStatus::kCrashed);
  EXPECT_EQ(stage.learner.result(1)->outcome.status(), RolloutStatus::kCrashed);
  EXPECT_THAT(stage.worker.errors(), HasSubstr("was ended by signal 11"));
}

/// The synthetic task's fates follow from theta alone.
TEST(WorkerProcessTest, WhoCrashesHangsOrFailsAmongSeveralIsAnsweredAsItIsAlone) {
  const std::string task = synthetic_task(
      R"({"crash_fraction": 0.06, "hang_fraction": 0.04, "fail_fraction": 0.1, "time_limit_s": 0.05})");
  constexpr int kCount = 48;
  const auto outcomes = [&](int salt, int at_once) {
    Stage stage(salt);
    EXPECT_TRUE(stage.learner.meet_worker());
    stage.learner.define(task);
    std::vector<Outcome> outcomes;
    for (int first = 0; first < kCount; first += at_once) {
      const auto answered = [&] {
        for (int i = first; i < first + at_once; ++i) {
          if (stage.learner.result(i) == nullptr) return false;
        }
        return true;
      };
      // While its evaluator starts anew the worker has no room: it is asked again.
      int num_asked = 0;
      do stage.learner.ask(first, at_once);
      while (!stage.learner.until(answered, 1s) && ++num_asked < 30);
      EXPECT_TRUE(answered()) << first;
      if (!answered()) return outcomes;
      for (int i = first; i < first + at_once; ++i) {
        outcomes.push_back(stage.learner.result(i)->outcome);
      }
    }
    return outcomes;
  };
  const std::vector<Outcome> alone = outcomes(10, 1);
  EXPECT_EQ(outcomes(11, kCount), alone);
  std::set<RolloutStatus> seen;
  for (const Outcome& outcome : alone) seen.insert(outcome.status());
  EXPECT_THAT(seen,
              ::testing::UnorderedElementsAre(RolloutStatus::kOk, RolloutStatus::kFailed,
                                              RolloutStatus::kCrashed, RolloutStatus::kTimedOut));
}

TEST(WorkerProcessTest, ARolloutThatHangsOrBlocksIsAnsweredAsTimedOut) {
  for (const char* mode : {"burn", "sleep"}) {
    Stage stage(7);
    ASSERT_TRUE(stage.learner.meet_worker());
    stage.learner.define(synthetic_task(
        std::string(R"({"hang_fraction": 1, "time_limit_s": 0.05, "mode": ")") + mode + "\"}"));
    stage.learner.ask(0, 1);
    ASSERT_TRUE(stage.learner.until([&] { return stage.learner.result(0) != nullptr; })) << mode;
    EXPECT_EQ(stage.learner.result(0)->outcome.status(), RolloutStatus::kTimedOut) << mode;
    EXPECT_FALSE(stage.learner.status->draining) << "the worker goes on";
  }
}

TEST(WorkerProcessTest, ASecondSignalEndsItWithoutWaiting) {
  Stage stage(8);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"mode": "sleep", "duration_us": 50000000})"));
  stage.learner.ask(0, 1);
  ASSERT_TRUE(stage.learner.until(
      [&] { return !stage.learner.status->held.empty() && stage.learner.reports.size() == 1; }));
  stage.worker.signal(SIGINT);
  ASSERT_TRUE(stage.learner.until([&] { return stage.learner.status->draining; }));
  EXPECT_EQ(stage.worker.wait(100ms), std::nullopt) << "a roll-out still runs";
  stage.worker.signal(SIGINT);
  EXPECT_EQ(stage.worker.wait(), 1);
}

TEST(WorkerProcessTest, LeavesNoEvaluatorBehindWhenItIsKilled) {
  Stage stage(9, 3);
  ASSERT_TRUE(stage.learner.meet_worker());
  stage.learner.define(synthetic_task(R"({"hang_fraction": 1, "time_limit_s": 1000})"));
  stage.learner.ask(0, 3);
  ASSERT_TRUE(stage.learner.until(
      [&] { return !stage.learner.status->held.empty() && stage.learner.reports.size() == 1; }));
  const auto evaluators = children_of(stage.worker.pid());
  ASSERT_THAT(evaluators, SizeIs(3));
  stage.worker.signal(SIGKILL);
  EXPECT_EQ(stage.worker.wait(), -SIGKILL);
  EXPECT_TRUE(stage.learner.until(
      [&] { return std::none_of(evaluators.begin(), evaluators.end(), is_alive); }));
}

}  // namespace
}  // namespace treeroll::worker
