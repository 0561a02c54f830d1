#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <vector>

#include "tests/worker_core/stage.h"

// Short roll-outs that an evaluator is given together.
namespace treeroll::worker {
namespace {

using protocol::RewardBatch;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

void allow_several(WorkerSettings& settings) { settings.together_max = 8; }

/// Numbers of the roll-outs given in a row to each evaluator since the last clear().
std::vector<std::vector<int>> given(const Stage& stage) {
  std::vector<std::vector<int>> packets;
  for (const RunRollouts& run : stage.effects<RunRollouts>()) {
    packets.emplace_back();
    for (const auto& request : run.requests) packets.back().push_back(request.key.number);
  }
  return packets;
}

/// The evaluator answers a roll-out of its packet.
void answer(Stage& stage, int evaluator, std::int64_t job, Duration duration) {
  stage.step(RolloutEvaluated{evaluator, job, Outcome::ok(.5), duration.count()});
}

/// A worker that knows how long a roll-out of the task takes.
class WorkerBatchesTest : public ::testing::Test {
 protected:
  void learn(Stage& stage, int num_evaluators, Duration duration) {
    stage.define();
    for (int i = 0; i < num_evaluators; ++i) {
      stage.ask({stage.request(1000 + i)});
      answer(stage, 0, stage.job(0), duration);
    }
    stage.clear();
  }
};

TEST_F(WorkerBatchesTest, ShortOnesGoTogetherOnceItIsKnownThatTheyAreShort) {
  Stage stage(1, allow_several);
  stage.define();
  stage.ask_for(20, 1);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(1)));
  stage.clear();
  answer(stage, 0, stage.job(0), 50us);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(2, 3, 4, 5, 6, 7, 8, 9)));
  const std::int64_t last = stage.job(0);
  for (std::int64_t job = last - 7; job <= last; ++job) answer(stage, 0, job, 3000us);
  EXPECT_EQ(given(stage).back().size(), 4U)
      << "they take longer of late: eight milliseconds in all";
}

TEST_F(WorkerBatchesTest, LongOnesAndThoseOfATaskThatIsNotRepeatableGoAlone) {
  {
    Stage stage(1, allow_several);
    learn(stage, 1, 4100us);
    stage.ask_for(20, 1);
    EXPECT_THAT(given(stage), ElementsAre(ElementsAre(1)));
  }
  Stage stage(1, allow_several);
  stage.task_facts.repeatable = false;
  learn(stage, 1, 1us);
  stage.ask_for(20, 1);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(1)));
}

TEST_F(WorkerBatchesTest, NoEvaluatorIdlesBesideOneThatHasSeveral) {
  Stage stage(2, allow_several);
  learn(stage, 1, 1us);
  stage.ask_for(12, 1);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6)))
      << "half of the six that are each one's share";
  stage.clear();
  stage.ask_for(3, 1);
  EXPECT_THAT(given(stage), IsEmpty());
  const std::int64_t last = stage.job(0);
  for (std::int64_t job = last - 2; job <= last; ++job) answer(stage, 0, job, 1us);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(7, 8, 9)))
      << "half of the four and a half that are left for each, rounded up";
}

TEST_F(WorkerBatchesTest, FewGoOneByOneSoThatEveryEvaluatorHasOne) {
  Stage stage(4, allow_several);
  learn(stage, 1, 1us);
  stage.ask_for(8, 1);
  EXPECT_THAT(given(stage),
              ElementsAre(ElementsAre(1), ElementsAre(2), ElementsAre(3), ElementsAre(4)));
}

TEST_F(WorkerBatchesTest, ThetasOfManyNumbersGoAlone) {
  Stage stage(1, allow_several);
  stage.policy_facts.theta_dim = 3000;
  stage.define();
  std::vector<protocol::RolloutRequest> requests;
  for (int number = 1; number <= 5; ++number) {
    requests.push_back(stage.request(number));
    requests.back().theta.assign(3000, .5);
  }
  stage.ask(std::move(requests));
  stage.clear();
  answer(stage, 0, stage.job(0), 1us);
  EXPECT_THAT(given(stage), ElementsAre(ElementsAre(2)));
}

/// One of them crashes whenever it is evaluated.
TEST_F(WorkerBatchesTest, WhoCrashesAmongSeveralIsFoundAloneAndNobodyElseIsStruck) {
  Stage stage(1, allow_several);
  learn(stage, 1, 50us);
  stage.ask_for(12, 1);
  std::map<int, int> deaths;
  int rounds = 0;
  for (; rounds < 100 && stage.status().num_evaluated < 13; ++rounds) {
    const std::vector<int> packet = given(stage).back();
    if (std::find(packet.begin(), packet.end(), 4) != packet.end()) {
      for (const int number : packet) ++deaths[number];
      stage.die(0, Death::kFatalSignal, 11);
      continue;
    }
    const std::int64_t last = stage.job(0);
    for (std::int64_t job = last - std::ssize(packet) + 1; job <= last; ++job) {
      answer(stage, 0, job, 50us);
    }
  }
  EXPECT_EQ(deaths[4], 4) << "once beside others, three times alone";
  EXPECT_LE(deaths[5], 1);
  std::map<int, RolloutStatus> statuses;
  for (const RewardBatch& batch : stage.sent<RewardBatch>()) {
    for (const auto& result : batch.results) {
      statuses[result.key.number] = result.outcome.status();
    }
  }
  for (int number = 1; number <= 12; ++number) {
    ASSERT_TRUE(statuses.contains(number)) << number;
    EXPECT_EQ(statuses[number], number == 4 ? RolloutStatus::kCrashed : RolloutStatus::kOk);
  }
}

}  // namespace
}  // namespace treeroll::worker
