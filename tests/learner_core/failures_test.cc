// What a learner says of roll-outs that fail and of trials that are void.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

const protocol::LearnerStatus& last_status(const Cluster& cluster) {
  const protocol::LearnerStatus* last = nullptr;
  for (const protocol::Message& message : cluster.sent) {
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) last = status;
  }
  return *last;
}

std::int64_t num_lines(const Cluster& cluster, const std::string& part) {
  return std::count_if(cluster.log.begin(), cluster.log.end(), [&](const LogLine& line) {
    return line.text.find(part) != std::string::npos;
  });
}

TEST(FailuresTest, AreLoggedWithRunAndRolloutAndReasonWithinTheLimiter) {
  Cluster cluster(small_study(100, 2));
  FakeWorker& worker = cluster.add_worker(1);
  worker.result_status = RolloutStatus::kDiverged;
  worker.reason = "the rate of link 2 is not finite at 0.31 s";
  cluster.start();
  cluster.run(seconds(100));
  EXPECT_THAT(cluster.log,
              Contains(Field(&LogLine::text,
                             HasSubstr("run 1 (flat, repetition 1), roll-out 0: diverged: the rate "
                                       "of link 2 is not finite at 0.31 s"))));
  EXPECT_LE(num_lines(cluster, "diverged"), LogLimiter::kLinesMax + 1);
  const protocol::LearnerStatus& status = last_status(cluster);
  EXPECT_EQ(status.num_failed, 200);
  EXPECT_THAT(status.last_failure, HasSubstr("(flat, repetition 1), the final policy: diverged"));
}

TEST(FailuresTest, OfAnEarlierIncarnationAreNotSaidAgainButCounted) {
  Cluster first(small_study(10, 1));
  first.add_worker(1).result_status = RolloutStatus::kFailed;
  first.start();
  first.run(seconds(100));
  Cluster resumed(small_study(10, 1));
  resumed.start();
  resumed.recover(first.journal);
  EXPECT_EQ(num_lines(resumed, "failed"), 0);
  EXPECT_EQ(resumed.core->counters().failed, 10);
}

/// Some trials are void; what is learnt does not show it, however late their answers come.
TEST(DiscardsTest, CostNoBudgetAndAreAskedAgainUnderAnotherSeed) {
  const auto learn = [](bool discards) {
    Cluster cluster(small_study(60, 2, 3));
    FakeWorker& fast = cluster.add_worker(1, milliseconds(3));
    FakeWorker& slow = cluster.add_worker(2, milliseconds(70));
    cluster.loss = .1;
    fast.discards_one_in = slow.discards_one_in = discards ? 4 : 0;
    cluster.start();
    cluster.run(seconds(1000));
    EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    const LedgerCounters counters = cluster.core->counters();
    EXPECT_EQ(counters.issued, 120);
    EXPECT_EQ(counters.applied, 120);
    EXPECT_EQ(counters.failed, 0);
    EXPECT_EQ(counters.rejected, 0);
    EXPECT_EQ(counters.discarded > 10, discards) << counters.discarded;
    if (discards) {
      EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr(": discarded: void"))));
    }
    std::vector<double> rewards;
    for (const RunRecord& run : cluster.core->run_records()) {
      for (const RolloutRecord& rollout : run.rollouts) rewards.push_back(rollout.reward);
      rewards.push_back(*run.final_reward);
    }
    return rewards;
  };
  EXPECT_EQ(learn(true), learn(false));
}

TEST(DiscardsTest, AreFoldedFromAnyPlaceOfAJournal) {
  Study study = small_study(20, 1, 2);
  Cluster whole(study);
  whole.add_worker(1).discards_one_in = 3;
  whole.start();
  whole.run(seconds(100));
  ASSERT_EQ(whole.core->outcome(), LearnerCore::Outcome::kDone);
  ASSERT_GT(whole.core->counters().discarded, 2);
  for (std::size_t kept = 0; kept <= whole.journal.size(); ++kept) {
    Cluster resumed(study);
    resumed.add_worker(3).discards_one_in = 3;
    resumed.start();
    resumed.recover(
        {whole.journal.begin(), whole.journal.begin() + static_cast<std::ptrdiff_t>(kept)});
    resumed.run(seconds(100));
    ASSERT_EQ(resumed.core->outcome(), LearnerCore::Outcome::kDone) << kept;
    EXPECT_EQ(resumed.core->counters().discarded, whole.core->counters().discarded);
    EXPECT_EQ(resumed.core->run_records()[0].final_reward,
              whole.core->run_records()[0].final_reward);
  }
}

TEST(DiscardsTest, PastTheLimitEndTheRunWithAWord) {
  Study study = small_study(20, 1);
  study.discards_max = 2;
  Cluster cluster(study);
  cluster.add_worker(1).discards_one_in = 1;
  cluster.start();
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().discarded, 6) << "of start, roll-out 0 and final policy";
  protocol::LearnerStatus last;
  for (const protocol::Message& message : cluster.sent) {
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) last = *status;
  }
  EXPECT_EQ(last.num_rollouts, 1) << "the run draws no more";
  EXPECT_EQ(last.num_applied, 1);
  EXPECT_EQ(last.num_evaluated, last.num_evaluations);
  EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text,
                                          HasSubstr("roll-out 0: discarded: void; more than 2 of "
                                                    "its trials are void, which ends the run"))));
}

TEST(StartTest, ARunThatNeverBeatsItSaysSo) {
  for (const bool rises : {true, false}) {
    Cluster cluster(small_study(10, 1));
    FakeWorker& worker = cluster.add_worker(1);
    cluster.start();
    bool is_first = true;
    cluster.run(seconds(100), [&] {
      // The start policy's answer is the first.
      if (is_first && !cluster.journal.empty()) worker.reward_factor = rises ? 1 : .01;
      is_first = is_first && cluster.journal.empty();
    });
    const auto said = Contains(Field(
        &LogLine::text, AllOf(HasSubstr("run 0 (flat, repetition 0) never beats its start policy"),
                              HasSubstr("its final policy 0.00"))));
    if (rises) {
      EXPECT_THAT(cluster.log, Not(said));
    } else {
      EXPECT_THAT(cluster.log, said);
    }
  }
}

}  // namespace
}  // namespace treeroll::learner
