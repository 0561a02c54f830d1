// The start of a layer may take seconds: runs that leave theirs together take turns.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
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

std::size_t num_at_switch(const LearnerCore& core) {
  return static_cast<std::size_t>(
      std::ranges::count_if(core.runs(), [](const Run& run) { return run.is_at_switch(); }));
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
  cluster.timer_delay = milliseconds(15);
  cluster.start();
  std::size_t before = 0;
  std::size_t most_waiting = 0;
  cluster.run(seconds(600), [&] {
    const std::size_t now = num_switches(*cluster.core);
    EXPECT_LE(now, before + 1);
    before = now;
    most_waiting = std::max(most_waiting, num_at_switch(*cluster.core));
  });
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(before, 12U);
  EXPECT_GE(most_waiting, 2U);
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
  int num_late_starts = 0;
  for (int ms = 20; ms <= 160; ms += 4) {
    Study study = switching_study(in_flight, in_sequence);
    study.stop_after = milliseconds(ms);
    Cluster live(study);
    for (const protocol::WorkerId id : {1, 2, 3}) live.add_worker(id, milliseconds(1));
    live.timer_delay = milliseconds(5);
    live.start();
    bool waits_past_the_time = false;
    live.run(seconds(600), [&] {
      waits_past_the_time |=
          live.now > TimePoint(*study.stop_after) && num_at_switch(*live.core) > 0;
    });
    num_late_starts += waits_past_the_time ? 1 : 0;
    ASSERT_EQ(live.core->outcome(), LearnerCore::Outcome::kDone);
    Cluster folded(study);
    folded.start();
    folded.recover(live.journal, live.times);
    EXPECT_EQ(folded.core->failure(), "") << ms;
    EXPECT_EQ(told(folded.core->run_records()), told(live.core->run_records())) << ms;
  }
  EXPECT_GT(num_late_starts, 0);
}

/// Asked once it waits for what is under way, asked twice for nothing.
TEST_P(SwitchesTest, WhatIsLeftBehindAtAStopIsWhatAFoldOfTheJournalComesTo) {
  const auto [in_flight, in_sequence] = GetParam();
  for (const int num_signals : {1, 2}) {
    const Study study = switching_study(in_flight, in_sequence);
    Cluster live(study);
    for (const protocol::WorkerId id : {1, 2, 3}) live.add_worker(id);
    live.timer_delay = milliseconds(15);
    live.start();
    std::size_t num_waiting = 0;
    bool is_asked = false;
    live.run(seconds(600), [&] {
      num_waiting = std::max(num_waiting, num_at_switch(*live.core));
      if (num_waiting < 2 || std::exchange(is_asked, true)) return;
      for (int i = 0; i < num_signals; ++i) live.stop();
    });
    ASSERT_EQ(live.core->outcome(), LearnerCore::Outcome::kStopped);
    EXPECT_EQ(num_at_switch(*live.core), 0U);
    Cluster folded(study);
    folded.start();
    folded.recover(live.journal);
    EXPECT_EQ(told(folded.core->run_records()), told(live.core->run_records())) << num_signals;
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, SwitchesTest,
                         ::testing::Values(std::pair{1, true}, std::pair{4, true},
                                           std::pair{4, false}));

}  // namespace
}  // namespace treeroll::learner
