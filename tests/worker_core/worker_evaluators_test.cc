#include <gmock/gmock.h>

#include <cmath>

#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::IsEmpty;
using ::testing::SizeIs;

protocol::RolloutResult last_result(const Stage& stage) {
  return stage.sent<RewardBatch>().at(stage.sent<RewardBatch>().size() - 1).results.back();
}

TEST(WorkerEvaluatorsTest, StartsThemAllAndGivesNothingToOneThatIsNotReady) {
  Stage stage(3);
  EXPECT_THAT(stage.effects<StartEvaluator>(), SizeIs(3));
  stage.define();
  stage.evaluators_start = false;
  stage.die(0, Death::kForeignSignal);
  stage.die(1, Death::kForeignSignal);
  stage.ask({stage.request(1), stage.request(2)});
  ASSERT_THAT(stage.runs(), SizeIs(1));
  EXPECT_EQ(stage.runs()[0].evaluator, 2);
  stage.step(EvaluatorReady{0});
  ASSERT_THAT(stage.runs(), SizeIs(2));
  EXPECT_EQ(stage.runs()[1].evaluator, 0);
}

TEST(WorkerEvaluatorsTest, ARolloutThatCrashesThreeOfThemIsAnsweredAsCrashed) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  for (int i = 0; i < 3; ++i) {
    EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
    EXPECT_EQ(stage.running(0).key.number, 1);
    stage.die(0, Death::kFatalSignal, 11);
  }
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kCrashed);
  EXPECT_EQ(last_result(stage).outcome.reason(),
            "3 evaluators ended under it, and the last one was ended by signal 11");
  EXPECT_EQ(last_result(stage).outcome.reward(), 0);
  EXPECT_EQ(stage.running(0).key.number, 2);
  const auto status = stage.status();
  EXPECT_EQ(status.num_restarts, 3);
  EXPECT_EQ(status.num_evaluated, 1);
  EXPECT_EQ(status.num_failed, 1);
}

TEST(WorkerEvaluatorsTest, ATaskThatCallsExitIsACrashToo) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  for (int i = 0; i < 3; ++i) stage.die(0, Death::kExited, 1);
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kCrashed);
  EXPECT_EQ(last_result(stage).outcome.reason(),
            "3 evaluators ended under it, and the last one exited with status 1");
}

TEST(WorkerEvaluatorsTest, ForeignSignalsNeverCountAndTheRolloutIsAnsweredInTheEnd) {
  Stage stage;
  stage.task_facts.time_limit = 100s;
  stage.define();
  for (int i = 0; i < 50; ++i) {
    stage.ask({stage.request(1, i)});  // as a learner does that has no other worker
    stage.die(0, Death::kForeignSignal, 9);
    stage.pass(5s);
  }
  stage.ask({stage.request(1, 50)});
  stage.die(0, Death::kFatalSignal, 11);  // nor do they add to a strike
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
  stage.finish(0, .5);
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kOk);
  EXPECT_EQ(last_result(stage).outcome.reward(), .5);
}

TEST(WorkerEvaluatorsTest, RestartsAtOnceThenEverMoreSeldomAndAtOnceAgainAfterAResult) {
  Stage stage;
  stage.evaluators_start = false;
  std::vector<Duration> delays;
  for (int i = 0; i < 12; ++i) {
    const TimePoint death = stage.now;
    stage.clear();
    stage.die(0, Death::kExited, 1);
    while (stage.effects<StartEvaluator>().empty()) stage.pass(1ms);
    delays.push_back(stage.now - death);
  }
  EXPECT_EQ(delays, (std::vector<Duration>{0ms, 10ms, 20ms, 40ms, 80ms, 160ms, 320ms, 640ms, 1280ms,
                                           2560ms, 5s, 5s}));
  stage.evaluators_start = true;
  stage.step(EvaluatorReady{0});
  stage.define();
  stage.ask({stage.request(1)});
  stage.finish(0);
  stage.clear();
  stage.die(0, Death::kForeignSignal);
  EXPECT_THAT(stage.effects<StartEvaluator>(), SizeIs(1));
}

TEST(WorkerEvaluatorsTest, OnesThatDieAllDayAreALineAMinute) {
  Stage stage;
  stage.evaluators_start = false;
  const TimePoint end = stage.now + 24h;
  while (stage.now < end) {
    stage.die(0, Death::kExited, 1);
    stage.pass(5s);
  }
  EXPECT_LE(stage.effects<LogLine>().size(), LogLimiter::kLinesMax + 24U * 60);
  EXPECT_THAT(stage.effects<LogLine>().back().text,
              testing::HasSubstr("evaluators that end: 12 more in the last 60 s"));
}

TEST(WorkerEvaluatorsTest, KillsOneThatDoesNotBecomeReady) {
  Stage stage;
  stage.evaluators_start = false;
  stage.die(0, Death::kForeignSignal);
  stage.pass(29s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.pass(2s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
}

TEST(WorkerEvaluatorsTest, ARolloutThatBurnsPastItsTimeLimitThriceIsAnsweredAsTimedOut) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.cpu_time = 2s;
  for (int i = 0; i < 3; ++i) {
    stage.clear();
    stage.pass(999ms);
    EXPECT_THAT(stage.effects<AskCpuTime>(), IsEmpty());
    stage.cpu_time = 1s;
    stage.pass(1ms);
    EXPECT_THAT(stage.effects<AskCpuTime>(), SizeIs(1)) << "half its limit";
    EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
    stage.cpu_time = 2s;
    stage.pass(1s);
    ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
    stage.die(0, Death::kForeignSignal, 9);
  }
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kTimedOut);
}

TEST(WorkerEvaluatorsTest, ASlowMachineGivesARolloutMoreWallTime) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.cpu_time = 1500ms;
  stage.pass(1s);
  EXPECT_THAT(stage.effects<AskCpuTime>(), SizeIs(1));
  stage.pass(500ms);
  EXPECT_THAT(stage.effects<AskCpuTime>(), SizeIs(2)) << "when it may be there at the earliest";
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.finish(0);
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kOk);
}

/// Passes time in which the evaluator gets this share of a core, until `end` of its CPU time or
/// until it is killed. @return how long it took
Duration work(Stage& stage, double share, Duration end) {
  const TimePoint start = stage.now;
  const Duration before = stage.cpu_time;
  while (stage.cpu_time < end && stage.effects<KillEvaluator>().empty()) {
    stage.pass(10ms);
    stage.cpu_time = before + std::chrono::nanoseconds(std::llround(
                                  share * static_cast<double>((stage.now - start).count())));
    stage.step(MessageReceived{protocol::RolloutBatch{kLearner, ++stage.sequence, {}, {}}});
  }
  return stage.now - start;
}

TEST(WorkerEvaluatorsTest, OneThatSleepsIsKilledWithinTwiceTheLimitAndASecondThriceThenAnswered) {
  Stage stage(1, [](WorkerSettings& settings) { settings.learner_gone = 59s; });
  stage.define();
  stage.ask({stage.request(1)});
  for (int i = 0; i < 3; ++i) {
    stage.clear();
    EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
    stage.pass(3s);
    EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty()) << "it may have been kept waiting";
    stage.pass(2s);
    ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
    stage.die(0, Death::kForeignSignal, 9);
  }
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kTimedOut);
}

TEST(WorkerEvaluatorsTest, OneThatBlocksAfterSomeWorkIsFoundAsSoonWhereverThatIs) {
  for (const Duration worked : {10ms, 50ms, 500ms, 990ms, 1010ms, 1500ms, 1990ms}) {
    Stage stage;
    stage.define();
    stage.ask({stage.request(1)});
    work(stage, 1, worked);
    ASSERT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
    stage.pass(5s);  // 2 x 2 s + 1 s
    EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1)) << to_seconds(worked);
  }
}

TEST(WorkerEvaluatorsTest, OneThatOnlyPollsIsBlockedToo) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  EXPECT_LE(work(stage, .001, 1s), 5s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
}

TEST(WorkerEvaluatorsTest, AnHonestRolloutOnACrowdedMachineIsNeitherStruckNorFailed) {
  for (const int evaluators_per_core : {1, 4, 16, 64}) {
    Stage stage;
    stage.define();
    stage.ask({stage.request(1)});
    const Duration took = work(stage, 1. / evaluators_per_core, 1900ms);
    ASSERT_THAT(stage.effects<KillEvaluator>(), IsEmpty()) << evaluators_per_core;
    EXPECT_GE(took, 1900ms * evaluators_per_core);
    stage.finish(0, .5);
    EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kOk);
  }
}

TEST(WorkerEvaluatorsTest, OneWithAProgramIsAskedToEndBeforeItIsKilled) {
  Stage stage(1, [](WorkerSettings& settings) { settings.end_grace = 2s; });
  stage.define();
  stage.ask({stage.request(1)});
  stage.cpu_time = 2s;
  stage.pass_heard(1500ms);
  ASSERT_THAT(stage.effects<EndEvaluator>(), SizeIs(1));
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty()) << "its program may have motors to stop";
  stage.pass_heard(1s);
  stage.finish(0);  // which takes nothing from the end of its grace
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
  stage.pass_heard(1s);
  EXPECT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
  EXPECT_THAT(stage.effects<EndEvaluator>(), SizeIs(1));
  stage.die(0, Death::kForeignSignal);
  stage.ask({stage.request(2)});
  EXPECT_EQ(stage.runs().back().request.key.number, 2);
}

TEST(WorkerEvaluatorsTest, AResultOnItsWayWhileWeKilledCounts) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.cpu_time = 3s;
  stage.pass(2s);
  ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
  stage.finish(0, .25);
  stage.die(0, Death::kForeignSignal, 9);
  EXPECT_EQ(last_result(stage).outcome.reward(), .25);
  EXPECT_EQ(stage.status().num_evaluated, 1);
}

TEST(WorkerEvaluatorsTest, IgnoresAnswersAndTimesOfAnEarlierJob) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1), stage.request(2)});
  const std::int64_t first = stage.job(0);
  stage.finish(0);
  stage.clear();
  stage.step(RolloutEvaluated{0, first, {.9, RolloutStatus::kOk}, 1});
  stage.step(CpuTimeMeasured{0, first, 100s});
  EXPECT_THAT(stage.sent<RewardBatch>(), IsEmpty());
  EXPECT_THAT(stage.effects<KillEvaluator>(), IsEmpty());
}

TEST(WorkerEvaluatorsTest, OneThatCannotLoadWhatAnotherCouldIsReplacedAndTheRolloutDoesNotFail) {
  Stage stage(2);
  stage.define();
  stage.ask({stage.request(1)});
  const int able = stage.runs().back().evaluator;
  stage.clear();
  stage.refusal = "no memory";
  stage.ask({stage.request(2)});
  ASSERT_THAT(stage.effects<KillEvaluator>(), SizeIs(1));
  const int unable = stage.effects<KillEvaluator>().back().evaluator;
  EXPECT_NE(unable, able);
  stage.refusal.clear();
  stage.die(unable, Death::kForeignSignal, 9);
  stage.finish(able);
  stage.pass(1s);
  EXPECT_EQ(stage.runs().back().request.key.number, 2);
  stage.finish(stage.runs().back().evaluator, .25);
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kOk);
  EXPECT_EQ(last_result(stage).outcome.reward(), .25);
  EXPECT_EQ(stage.status().num_failed, 0);
}

TEST(WorkerEvaluatorsTest, ARewardThatIsNoFiniteNumberIsAFailure) {
  Stage stage;
  stage.define();
  for (const double reward : {std::nan(""), HUGE_VAL, -.1}) {
    stage.ask({stage.request(static_cast<int>(stage.sequence))});
    stage.finish(0, reward);
    EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kFailed);
    EXPECT_EQ(last_result(stage).outcome.reward(), 0);
  }
}

TEST(WorkerEvaluatorsTest, AFailedRolloutHasRewardZero) {
  Stage stage;
  stage.define();
  stage.ask({stage.request(1)});
  stage.finish(0, .7, RolloutStatus::kDiverged);
  EXPECT_EQ(last_result(stage).outcome.status(), RolloutStatus::kDiverged);
  EXPECT_EQ(last_result(stage).outcome.reward(), 0);
  EXPECT_EQ(stage.status().num_failed, 1);
}

}  // namespace
}  // namespace treeroll::worker
