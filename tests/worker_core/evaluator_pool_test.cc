#include "workers/core/evaluator_pool.h"
#include "common/protocol/pieces.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <variant>

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

  std::optional<WorkEnd> on(const EvaluatorEvent& event) { return pool_.on(turn_, event, shelf_); }

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
      if (const auto* run = std::get_if<RunRollout>(&effect)) job = run->job;
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
  pool_.evaluate(turn_, 0, work(7), shelf_);
  EXPECT_EQ(pool_.idle_evaluator(), 1);
  const auto end = on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000});
  ASSERT_TRUE(end);
  const auto* answer = std::get_if<WorkAnswered>(&*end);
  ASSERT_NE(answer, nullptr);
  EXPECT_EQ(answer->name, work(7).name);
  EXPECT_EQ(answer->outcome.reward(), .5);
  EXPECT_EQ(pool_.idle_evaluator(), 0);
}

TEST_F(EvaluatorPoolTest, WithdrawnWorkKeepsItsEvaluatorBusyAndComesToNothing) {
  pool_.evaluate(turn_, 0, work(7), shelf_);
  pool_.withdraw(work(7).name);
  EXPECT_EQ(pool_.idle_evaluator(), 1);
  EXPECT_FALSE(on(RolloutEvaluated{0, job(), {.5, RolloutStatus::kOk}, 1000}));
  EXPECT_EQ(pool_.idle_evaluator(), 0);
}

TEST_F(EvaluatorPoolTest, TheSameWorkGivenAgainIsAnsweredByWhomItWasGivenLast) {
  pool_.evaluate(turn_, 0, work(7), shelf_);
  const std::int64_t withdrawn = job();
  pool_.withdraw(work(7).name);
  pool_.evaluate(turn_, 1, work(7), shelf_);
  for (const DefinitionName& name : {task_, policy_}) {
    on(DefinitionLoaded{1, name, true, "", {1, 1, 2, 2s}});
  }
  EXPECT_FALSE(on(RolloutEvaluated{0, withdrawn, {.5, RolloutStatus::kOk}, 1000}));
  EXPECT_TRUE(on(RolloutEvaluated{1, job(), {.5, RolloutStatus::kOk}, 1000}));
}

TEST_F(EvaluatorPoolTest, PutsWorkBackWithItsMishapsUntilTheyAreAnAnswer) {
  Work given = work(7);
  given.mishaps.num_strikes = settings_.num_strikes_max - 2;
  pool_.evaluate(turn_, 0, given, shelf_);
  const auto first = on(EvaluatorDied{0, Death::kFatalSignal, 11});
  ASSERT_TRUE(first && std::holds_alternative<WorkPutBack>(*first));
  given.mishaps = std::get<WorkPutBack>(*first).mishaps;
  EXPECT_EQ(given.mishaps.num_strikes, settings_.num_strikes_max - 1);
  pool_.evaluate(turn_, 1, given, shelf_);
  const auto second = on(EvaluatorDied{1, Death::kFatalSignal, 11});
  ASSERT_TRUE(second && std::holds_alternative<WorkAnswered>(*second));
  EXPECT_EQ(std::get<WorkAnswered>(*second).outcome.status(), RolloutStatus::kCrashed);
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
