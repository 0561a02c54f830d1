// The start of a layer may take seconds: runs that leave theirs together take turns.
#include <gtest/gtest.h>

#include <cstddef>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::seconds;

/// Every run leaves its first layer with its tenth result.
Study switching_study(int in_flight, bool in_sequence) {
  Study study = small_study(40, 12, in_flight);
  study.in_sequence = in_sequence;
  study.final_evaluations = 2;
  study.conditions[0].start = two_layers();
  study.conditions[0].exploration.last_layer = 2;
  study.conditions[0].exploration.convergence_window = 10;
  study.conditions[0].exploration.convergence_slope = 1000;
  return study;
}

std::size_t num_switches(const LearnerCore& core) {
  std::size_t sum = 0;
  for (const Run& run : core.runs()) sum += run.exploration().switches().size();
  return sum;
}

std::string told(const std::vector<RunRecord>& runs) {
  std::string text;
  for (const RunRecord& run : runs) {
    text += run.final_policy + run.best_policy;
    for (const int rollout : run.switches) text += " " + std::to_string(rollout);
    for (const RolloutRecord& rollout : run.rollouts) {
      text += " " + std::to_string(rollout.reward) + "/" + std::to_string(rollout.layer);
    }
  }
  return text;
}

class SwitchesTest : public ::testing::TestWithParam<std::pair<int, bool>> {};

/// All answers that are on their way come in one turn, and with them many a layer ends.
TEST_P(SwitchesTest, OneStartIsComputedATurn) {
  const auto [in_flight, in_sequence] = GetParam();
  Cluster cluster(switching_study(in_flight, in_sequence));
  for (const protocol::WorkerId id : {1, 2, 3}) cluster.add_worker(id);
  cluster.loss = .1;
  cluster.start();
  std::size_t before = 0;
  std::size_t most_waiting = 0;
  cluster.run(seconds(600), [&] {
    const std::size_t now = num_switches(*cluster.core);
    EXPECT_LE(now, before + 1);
    before = now;
    const auto waiting = std::ranges::count_if(
        cluster.core->runs(), [](const learner::Run& run) { return run.is_at_switch(); });
    most_waiting = std::max(most_waiting, static_cast<std::size_t>(waiting));
  });
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(before, 12U);
  EXPECT_GE(most_waiting, 1U);
}

/// A fold makes each switch at once: what a run has come to does not tell.
TEST_P(SwitchesTest, AFoldOfTheJournalComesToTheSame) {
  const auto [in_flight, in_sequence] = GetParam();
  const Study study = switching_study(in_flight, in_sequence);
  Cluster live(study);
  for (const protocol::WorkerId id : {1, 2, 3}) live.add_worker(id);
  live.loss = .1;
  live.start();
  live.run(seconds(600));
  ASSERT_EQ(live.core->outcome(), LearnerCore::Outcome::kDone);
  Cluster folded(study);
  folded.start();
  folded.recover(live.journal);
  EXPECT_EQ(folded.core->failure(), "");
  EXPECT_EQ(told(folded.core->run_records()), told(live.core->run_records()));
}

/// The time is up while starts wait to be computed: not before they are.
TEST_P(SwitchesTest, AStudyIsStoppedWithItsRunsInTheirNewLayers) {
  const auto [in_flight, in_sequence] = GetParam();
  for (int ms = 60; ms <= 160; ms += 4) {
    Study study = switching_study(in_flight, in_sequence);
    study.stop_after = std::chrono::milliseconds(ms);
    Cluster live(study);
    for (const protocol::WorkerId id : {1, 2, 3}) live.add_worker(id, std::chrono::milliseconds(1));
    live.start();
    live.run(seconds(600));
    ASSERT_EQ(live.core->outcome(), LearnerCore::Outcome::kDone);
    Cluster folded(study);
    folded.start();
    folded.recover(live.journal, live.times);
    EXPECT_EQ(folded.core->failure(), "") << ms;
    EXPECT_EQ(told(folded.core->run_records()), told(live.core->run_records())) << ms;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, SwitchesTest,
                         ::testing::Values(std::pair{1, true}, std::pair{4, true},
                                           std::pair{4, false}));

}  // namespace
}  // namespace treeroll::learner
