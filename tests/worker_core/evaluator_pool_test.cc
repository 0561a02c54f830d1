#include "workers/core/evaluator_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <variant>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/log_limiter.h"
#include "tests/worker_core/stage.h"

namespace treeroll::worker {
namespace {

using namespace std::chrono_literals;

/// A pool of two evaluators that have started, and a task and a policy that are accepted.
class EvaluatorPoolTest : public ::testing::Test {
 protected:
  EvaluatorPoolTest() {
    pool_.start(turn_);
    for (int i = 0; i < 2; ++i) on(EvaluatorReady{i});
    for (const DefinitionName& name : {task_, policy_}) {
      const std::string content = name.kind == DefinitionKind::kTask ? "task" : "policy";
      shelf_.receive(turn_, protocol::definition_piece(1, name, content, 0), RolloutQueue{});
      pool_.check(turn_, 0, *shelf_.take_unchecked(), shelf_);
      on(DefinitionLoaded{0, name, true, "", {1, 1, 2, 2s}});
    }
  }

  std::vector<WorkEnd> on(const EvaluatorEvent& event) { return pool_.on(turn_, event, shelf_); }
  void evaluate(int evaluator, const std::vector<Work>& works) {
    pool_.evaluate(turn_, evaluator, works, shelf_);
  }

  Work work(int number) const {
    return {.name = {.learner = 1, .key = {.run = 0, .number = number}},
            .request = {.key = {.run = 0, .number = number},
                        .task_id = task_.id,
                        .policy_id = policy_.id,
                        .theta = {1, 2}},
            .mishaps = {}};
  }

  std::int64_t job() const {
    std::int64_t job = 0;
    for (const Effect& effect : effects_) {
      const auto* run = std::get_if<RunRollouts>(&effect);
      if (run) job = run->job + std::ssize(run->requests) - 1;
    }
    return job;
  }

  WorkerSettings settings_ = stage_settings(2);
  DefinitionName task_{DefinitionKind::kTask, content_hash("task")};
  DefinitionName policy_{DefinitionKind::kPolicy, content_hash("policy")};
  DefinitionShelf shelf_{settings_};
  EvaluatorPool pool_{settings_};
  Effects effects_;
  LogLimiter limiter_;
  Turn turn_{TimePoint(1h), effects_, limiter_};
};

TEST_F(EvaluatorPoolTest, HandsWorkBackWithItsAnswer) {
  ASSERT_EQ(pool_.idle_evaluator(), 0);
  evaluate(0, {work(7)});
  EXPECT_EQ(pool_.idle_evaluator(), 1);
  const auto ends = on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000});
  ASSERT_EQ(ends.size(), 1U);
  const auto* answer = std::get_if<WorkAnswered>(&ends[0]);
  ASSERT_NE(answer, nullptr);
  EXPECT_EQ(answer->name, work(7).name);
  EXPECT_EQ(answer->outcome.reward(), .5);
  EXPECT_EQ(pool_.idle_evaluator(), 0);
}

TEST_F(EvaluatorPoolTest, WithdrawnWorkKeepsItsEvaluatorBusyAndComesToNothing) {
  evaluate(0, {work(7)});
  pool_.withdraw(work(7).name);
  EXPECT_EQ(pool_.idle_evaluator(), 1);
  EXPECT_TRUE(on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000}).empty());
  EXPECT_EQ(pool_.idle_evaluator(), 0);
}

TEST_F(EvaluatorPoolTest, TheSameWorkGivenAgainIsAnsweredByWhomItWasGivenLast) {
  evaluate(0, {work(7)});
  const std::int64_t withdrawn = job();
  pool_.withdraw(work(7).name);
  evaluate(1, {work(7)});
  for (const DefinitionName& name : {task_, policy_}) {
    on(DefinitionLoaded{1, name, true, "", {1, 1, 2, 2s}});
  }
  EXPECT_TRUE(on(RolloutEvaluated{0, withdrawn, {.5, RolloutStatus::kOk}, 1000}).empty());
  EXPECT_EQ(on(RolloutEvaluated{1, job(), {.5, RolloutStatus::kOk}, 1000}).size(), 1U);
}

TEST_F(EvaluatorPoolTest, PutsWorkBackWithItsMishapsUntilTheyAreAnAnswer) {
  Work given = work(7);
  given.mishaps.num_strikes = settings_.num_strikes_max - 2;
  evaluate(0, {given});
  const auto first = on(EvaluatorDied{0, Death::kFatalSignal, 11});
  ASSERT_TRUE(first.size() == 1 && std::holds_alternative<WorkPutBack>(first[0]));
  given.mishaps = std::get<WorkPutBack>(first[0]).mishaps;
  EXPECT_EQ(given.mishaps.num_strikes, settings_.num_strikes_max - 1);
  evaluate(1, {given});
  const auto second = on(EvaluatorDied{1, Death::kFatalSignal, 11});
  ASSERT_TRUE(second.size() == 1 && std::holds_alternative<WorkAnswered>(second[0]));
  EXPECT_EQ(std::get<WorkAnswered>(second[0]).outcome.status(), RolloutStatus::kCrashed);
}

TEST_F(EvaluatorPoolTest, WorkGivenTogetherIsAnsweredOneByOneAndKeepsItsEvaluatorBusyToTheLast) {
  evaluate(0, {work(1), work(2), work(3)});
  const RunRollouts run = std::get<RunRollouts>(effects_.back());
  ASSERT_EQ(run.requests.size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(run.requests[i].key.number, i + 1);
  pool_.withdraw(work(2).name);
  for (const std::int64_t i : {2, 1, 2, 3, -1, 0}) {
    EXPECT_EQ(pool_.idle_evaluator(), 1);
    const auto ends = on(RolloutEvaluated{0, run.job + i, {.5, RolloutStatus::kOk}, 1000});
    const bool is_new = i == 0 || i == 2;
    if (!is_new || ends.empty()) {
      EXPECT_TRUE(ends.empty()) << i << ": withdrawn, answered already, or no job of it";
      continue;
    }
    EXPECT_EQ(std::get<WorkAnswered>(ends[0]).name, work(static_cast<int>(i) + 1).name);
  }
  EXPECT_EQ(pool_.idle_evaluator(), 0);
  evaluate(0, {work(4)});
  EXPECT_GT(job(), run.job + 2) << "a job's number is used twice";
}

TEST_F(EvaluatorPoolTest, WhatIsWithdrawnWhileADefinitionIsLoadedIsNotEvaluated) {
  evaluate(1, {work(1), work(2), work(3)});
  pool_.withdraw(work(1).name);
  pool_.withdraw(work(3).name);
  for (const DefinitionName& name : {task_, policy_}) {
    on(DefinitionLoaded{1, name, true, "", {1, 1, 2, 2s}});
  }
  const RunRollouts run = std::get<RunRollouts>(effects_.back());
  ASSERT_EQ(run.requests.size(), 1U);
  EXPECT_EQ(run.requests[0].key.number, 2);
  const auto ends = on(RolloutEvaluated{1, run.job, {.5, RolloutStatus::kOk}, 1000});
  ASSERT_EQ(ends.size(), 1U);
  EXPECT_EQ(std::get<WorkAnswered>(ends[0]).name, work(2).name);
  evaluate(0, {work(4)});
  EXPECT_EQ(pool_.idle_evaluator(), 1) << "what was withdrawn is not waited for";
}

TEST_F(EvaluatorPoolTest, LoadsEachPolicyOfItsWorkThatIsStillWanted) {
  const std::array<const char*, 3> contents = {"first", "second", "third"};
  std::vector<Work> works;
  for (int i = 0; i < 3; ++i) {
    const DefinitionName name{DefinitionKind::kPolicy, content_hash(contents[i])};
    shelf_.receive(turn_, protocol::definition_piece(1, name, contents[i], 0), RolloutQueue{});
    pool_.check(turn_, 1, *shelf_.take_unchecked(), shelf_);
    on(DefinitionLoaded{1, name, true, "", {1, 1, 2, 2s}});
    works.push_back(work(i + 1));
    works.back().request.policy_id = name.id;
  }
  effects_.clear();
  evaluate(0, works);
  pool_.withdraw(works[1].name);
  const auto loaded = [&] { return std::get<LoadDefinition>(effects_.back()).name; };
  for (const int i : {0, 2}) {
    ASSERT_EQ(loaded().id, works[static_cast<std::size_t>(i)].request.policy_id);
    on(DefinitionLoaded{0, loaded(), true, "", {1, 1, 2, 2s}});
  }
  const RunRollouts run = std::get<RunRollouts>(effects_.back());
  ASSERT_EQ(run.requests.size(), 2U);
  EXPECT_EQ(run.requests[0].policy_id, works[0].request.policy_id);
  EXPECT_EQ(run.requests[1].policy_id, works[2].request.policy_id);
}

TEST_F(EvaluatorPoolTest, WhereItIsOneAtATimeATaskIsLoadedAnewBeforeTheClockOfItsRollouts) {
  settings_.one_task_at_a_time = true;
  const DefinitionName other{DefinitionKind::kTask, content_hash("other")};
  shelf_.receive(turn_, protocol::definition_piece(1, other, "other", 0), RolloutQueue{});
  pool_.check(turn_, 0, *shelf_.take_unchecked(), shelf_);
  on(DefinitionLoaded{0, other, true, "", {1, 1, 2, 2s}});
  effects_.clear();
  evaluate(0, {work(7)});  // of the first task
  std::vector<DefinitionName> forgotten;
  std::vector<DefinitionName> loaded;
  for (const Effect& effect : effects_) {
    if (const auto* forget = std::get_if<ForgetDefinition>(&effect))
      forgotten.push_back(forget->name);
    if (const auto* load = std::get_if<LoadDefinition>(&effect)) loaded.push_back(load->name);
    EXPECT_FALSE(std::holds_alternative<RunRollouts>(effect));
  }
  EXPECT_EQ(forgotten, std::vector{other});
  EXPECT_EQ(loaded, std::vector{task_});
  on(DefinitionLoaded{0, task_, true, "", {1, 1, 2, 2s}});
  EXPECT_EQ(on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000}).size(), 1U);
}

TEST_F(EvaluatorPoolTest, NothingCountsAgainstWorkWhoseEvaluatorEndsUnderSeveral) {
  for (const Death death : {Death::kFatalSignal, Death::kExited, Death::kForeignSignal}) {
    evaluate(0, {work(1), work(2), work(3)});
    const std::int64_t first = job() - 2;
    EXPECT_EQ(on(RolloutEvaluated{0, first + 1, {.5, RolloutStatus::kOk}, 1000}).size(), 1U);
    const auto ends = on(EvaluatorDied{0, death, 11});
    ASSERT_EQ(ends.size(), 2U) << "the second was answered";
    for (const WorkEnd& end : ends) {
      const auto& back = std::get<WorkPutBack>(end);
      EXPECT_EQ(back.mishaps.num_strikes, 0);
      EXPECT_EQ(back.mishaps.num_accidents, 0);
      EXPECT_TRUE(back.mishaps.alone);
    }
    pool_.watch(turn_);
    on(EvaluatorReady{0});
    evaluate(0, {work(9)});
    for (const DefinitionName& name : {task_, policy_}) {
      on(DefinitionLoaded{0, name, true, "", {1, 1, 2, 2s}});
    }
    on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000});
    ASSERT_EQ(pool_.idle_evaluator(), 0);
  }
}

/// The limit of the fixture's task is 2 s.
TEST_F(EvaluatorPoolTest, WorkGivenTogetherHasTheSumOfTheTimeLimits) {
  evaluate(0, {work(1), work(2), work(3)});
  const std::int64_t first = job() - 2;
  const auto killed = [this] {
    return std::any_of(effects_.begin(), effects_.end(), [](const Effect& effect) {
      return std::holds_alternative<KillEvaluator>(effect);
    });
  };
  on(CpuTimeMeasured{0, first, 5900ms});
  EXPECT_FALSE(killed());
  on(CpuTimeMeasured{0, first, 6000ms});
  EXPECT_TRUE(killed());
  const auto ends = on(EvaluatorDied{0, Death::kForeignSignal, 9});
  ASSERT_EQ(ends.size(), 3U);
  EXPECT_EQ(std::get<WorkPutBack>(ends[0]).mishaps.num_strikes, 0);
}

TEST_F(EvaluatorPoolTest, WhatIsBesideWorkThatIsEndedIsPutBack) {
  evaluate(0, {work(1), work(2)});
  pool_.end_work(turn_, work(1).name);
  const auto ends = on(EvaluatorDied{0, Death::kForeignSignal, 9});
  ASSERT_EQ(ends.size(), 1U);
  EXPECT_EQ(std::get<WorkPutBack>(ends[0]).name, work(2).name);
}

TEST_F(EvaluatorPoolTest, IsInTroubleOnceEveryEvaluatorHasDiedTwiceForNothing) {
  for (int i = 0; i < 2; ++i) {
    on(EvaluatorDied{i, Death::kForeignSignal, 9});
    EXPECT_FALSE(pool_.in_trouble());
    on(EvaluatorReady{i});
  }
  on(EvaluatorDied{0, Death::kForeignSignal, 9});
  EXPECT_FALSE(pool_.in_trouble());
  on(EvaluatorDied{1, Death::kForeignSignal, 9});
  EXPECT_TRUE(pool_.in_trouble());
}

}  // namespace
}  // namespace treeroll::worker
