#include "learner/core/learner_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

std::vector<double> rewards_of(const LearnerCore& core) {
  std::vector<double> rewards;
  for (const RunRecord& run : core.run_records()) {
    for (const RolloutRecord& rollout : run.rollouts) rewards.push_back(rollout.reward);
    rewards.push_back(run.final_reward.value_or(-1));
  }
  return rewards;
}

std::vector<double> reference_rewards(const Study& study) {
  Cluster cluster(study);
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(10'000));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  return rewards_of(*cluster.core);
}

std::string last_waiting(const Cluster& cluster) {
  std::string waiting;
  for (const protocol::Message& message : cluster.sent) {
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
      waiting = status->waiting_for;
    }
  }
  return waiting;
}

TEST(LearnerCoreTest, GivesEveryRunExactlyItsRolloutsAndAnEvaluation) {
  Cluster cluster(small_study(40, 3));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  const LedgerCounters counters = cluster.core->counters();
  EXPECT_EQ(counters.issued, 120);
  EXPECT_EQ(counters.applied, 120);
  EXPECT_EQ(counters.pending, 0);
  EXPECT_EQ(counters.reissued, 0);
  for (const RunRecord& run : cluster.core->run_records()) {
    EXPECT_EQ(run.rollouts.size(), 40U);
    EXPECT_TRUE(run.final_reward.has_value());
    EXPECT_GT(run.best_reward, run.rollouts.front().reward);
  }
}

TEST(LearnerCoreTest, ARunThatStopsEarlyIsDoneWithWhatWasDrawn) {
  for (const bool in_sequence : {true, false}) {
    Study study = small_study(400, 3, 4);
    study.in_sequence = in_sequence;
    study.conditions[0].exploration.stop_at_reward = .8;
    Cluster cluster(study);
    cluster.loss = .2;
    for (int id = 1; id <= 3; ++id) cluster.add_worker(id, milliseconds(7 * id));
    cluster.start();
    cluster.run(seconds(1000));
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    const LedgerCounters counters = cluster.core->counters();
    EXPECT_EQ(counters.pending, 0);
    std::int64_t applied = 0;
    for (const RunRecord& run : cluster.core->run_records()) {
      EXPECT_GE(run.best_reward, .8);
      EXPECT_TRUE(run.final_reward.has_value());
      ASSERT_LT(run.rollouts.size(), 400U);
      applied += static_cast<std::int64_t>(run.rollouts.size());
      // The first to reach the target is followed by at most the three that were in flight; by
      // arrival, by those too that were drawn while its answer was lost.
      std::size_t first = 0;
      while (run.rollouts[first].reward < .8) ++first;
      EXPECT_LE(run.rollouts.size() - first, in_sequence ? 4U : 12U);
      for (const RolloutRecord& rollout : run.rollouts) EXPECT_EQ(rollout.layer, 1);
    }
    EXPECT_EQ(counters.applied, applied);
    EXPECT_LT(counters.issued, 1200);
  }
}

TEST(LearnerCoreTest, GivesTheSameRewardsWithManyWorkersLossAndDeaths) {
  for (const int in_flight : {1, 4}) {
    const Study study = small_study(60, 4, in_flight);
    const std::vector<double> reference = reference_rewards(study);
    Cluster cluster(study);
    cluster.loss = .3;
    for (int id = 1; id <= 5; ++id) cluster.add_worker(id, milliseconds(3 * id));
    cluster.start();
    bool killed = false;
    cluster.run(seconds(10'000), [&] {
      const LedgerCounters counters = cluster.core->counters();
      ASSERT_EQ(counters.issued, counters.applied + counters.pending);
      if (!killed && counters.applied > 60) {
        cluster.remove_worker(2);
        cluster.remove_worker(0);
        killed = true;
      }
    });
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    EXPECT_TRUE(killed);
    EXPECT_GT(cluster.core->counters().reissued, 0);
    EXPECT_EQ(rewards_of(*cluster.core), reference) << "in flight " << in_flight;
  }
}

TEST(LearnerCoreTest, AppliesInArrivalOrderWhenTheStudySaysSo) {
  Study study = small_study(50, 1, 4);
  study.in_sequence = false;
  Cluster cluster(study);
  cluster.add_worker(1, milliseconds(5));
  cluster.add_worker(2, milliseconds(33));
  cluster.start();
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().applied, 50);
  EXPECT_NE(rewards_of(*cluster.core), reference_rewards(small_study(50, 1, 4)));
}

TEST(LearnerCoreTest, TakesInAWorkerThatJoinsLateAndCarriesOnWhenOneLeaves) {
  Cluster cluster(small_study(200, 4));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(10'000), [&] {
    const auto applied = cluster.core->counters().applied;
    if (applied == 200 && cluster.workers.size() == 1) cluster.add_worker(2);
    if (applied == 500 && cluster.workers.size() == 2) cluster.workers[0]->draining = true;
  });
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().applied, 800);
  std::int64_t sum = 0;
  for (const WorkerRecord& worker : cluster.core->worker_records()) {
    EXPECT_GT(worker.num_accepted, 100);
    sum += worker.num_accepted;
  }
  EXPECT_EQ(sum, 800 + 2 * 4);  // the evaluations too
}

TEST(LearnerCoreTest, GivesNoMoreWorkToAWorkerWhoseRewardIsOutOfRange) {
  Cluster cluster(small_study(30, 1));
  cluster.add_worker(1).reward_factor = 100;
  cluster.add_worker(2, milliseconds(11));
  cluster.start();
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(rewards_of(*cluster.core), reference_rewards(small_study(30, 1)));
  EXPECT_EQ(cluster.core->counters().rejected, 1);
  EXPECT_EQ(cluster.workers[0]->num_evaluated, 1);
  EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr("outside the task's range"))));
}

TEST(LearnerCoreTest, WaitsForADescriptionBeforeTheFirstRollout) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false);
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(100), [&] {
    bool described = false;
    for (const protocol::Message& message : cluster.sent) {
      described = described || std::holds_alternative<protocol::DefinitionPiece>(message);
      if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
        ASSERT_TRUE(described || batch->rollouts.empty());
      }
    }
  });
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

TEST(LearnerCoreTest, FailsWhenTheDescriptionOfWhoHasAKeyDoesNotFitThePolicy) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false, true, /*is_authenticated=*/true);
  cluster.description =
      R"({"deterministic":true,"input_dim":2,"output_dim":1,"reward_max":1,"reward_min":0,"time_limit_s":1})";
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(10));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kFailed);
  EXPECT_THAT(cluster.core->failure(), HasSubstr("takes 2 inputs"));
}

TEST(LearnerCoreTest, SaysWhyNothingMoves) {
  {
    Cluster cluster(small_study(10, 1));
    cluster.start();
    cluster.run(seconds(6));
    EXPECT_THAT(last_waiting(cluster), HasSubstr("no workers"));
  }
  {
    Cluster cluster(small_study(10, 1), /*knows_task=*/false);
    cluster.add_worker(1).refusal = "there is no task bump";
    cluster.start();
    cluster.run(seconds(6));
    EXPECT_THAT(last_waiting(cluster), HasSubstr("lack the task of condition flat: there is no"));
  }
  {
    Cluster cluster(small_study(10, 1));
    cluster.add_worker(1, seconds(1000));
    cluster.start();
    cluster.run(seconds(9));
    EXPECT_EQ(last_waiting(cluster), "") << "by its time limit it may take 10 s";
    cluster.run(seconds(6));
    EXPECT_THAT(last_waiting(cluster), HasSubstr("2 roll-outs are with 1 workers"));
  }
}

/// A warning would be written over the question at the operator's terminal.
TEST(LearnerCoreTest, IsNotImpatientWithTheOperatorOfARobot) {
  for (const bool repeatable : {true, false}) {
    Cluster cluster(small_study(1000, 1), /*knows_task=*/true, repeatable);
    cluster.add_worker(1, milliseconds(10));
    cluster.start();
    cluster.run(seconds(1));
    cluster.remove_worker(0);
    cluster.add_worker(2, seconds(1000));
    cluster.run(seconds(8));
    EXPECT_EQ(last_waiting(cluster).empty(), !repeatable) << last_waiting(cluster);
    cluster.run(seconds(8));
    EXPECT_THAT(last_waiting(cluster), HasSubstr("roll-outs are with")) << "past its time limit";
  }
}

TEST(LearnerCoreTest, IssuesARolloutAgainWhenItsWorkerFallsSilent) {
  Cluster cluster(small_study(400, 1));
  cluster.add_worker(1, seconds(1000));
  cluster.start();
  cluster.run(seconds(1));
  cluster.remove_worker(0);
  cluster.add_worker(2);
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().reissued, 2) << "with the start's evaluation";
  EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr("has left"))));
}

TEST(LearnerCoreTest, KeepsALeaseWhileItsWorkerSaysItHoldsTheRollout) {
  Cluster cluster(small_study(3, 1));
  cluster.add_worker(1, seconds(60));
  cluster.start();
  cluster.run(seconds(1000));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().reissued, 0);
  EXPECT_EQ(cluster.workers[0]->num_requests, 5);
}

TEST(LearnerCoreTest, ResumesFromAnyPlaceOfItsJournalToTheSameRewards) {
  for (const bool in_sequence : {true, false}) {
    Study study = small_study(30, 2, 3);
    study.in_sequence = in_sequence;
    Cluster whole(study);
    whole.add_worker(1, milliseconds(5));
    whole.add_worker(2, milliseconds(13));
    whole.start();
    whole.run(seconds(100));
    ASSERT_EQ(whole.core->outcome(), LearnerCore::Outcome::kDone);
    ASSERT_EQ(whole.journal.size(), 64U);
    for (std::size_t kept = 0; kept <= whole.journal.size(); ++kept) {
      Cluster resumed(study);
      resumed.add_worker(3);
      resumed.start();
      resumed.recover(
          {whole.journal.begin(), whole.journal.begin() + static_cast<std::ptrdiff_t>(kept)});
      resumed.run(seconds(100));
      ASSERT_EQ(resumed.core->outcome(), LearnerCore::Outcome::kDone);
      EXPECT_EQ(resumed.core->counters().applied, 60);
      EXPECT_EQ(resumed.journal.size(), 64 - kept);
      if (!in_sequence) continue;
      EXPECT_EQ(rewards_of(*resumed.core), rewards_of(*whole.core)) << kept;
    }
  }
}

TEST(LearnerCoreTest, RefusesAJournalOfAnotherStudy) {
  Cluster one(small_study(10, 1));
  one.add_worker(1);
  one.start();
  one.run(seconds(100));
  Study other = small_study(10, 1);
  other.seed = 6;
  Cluster resumed(other);
  resumed.start();
  resumed.recover(one.journal);
  EXPECT_EQ(resumed.core->outcome(), LearnerCore::Outcome::kFailed);
  EXPECT_THAT(resumed.core->failure(), HasSubstr("draws with other numbers"));
}

TEST(LearnerCoreTest, StopsOnceWhatIsUnderWayIsInAndNoLaterThanItsGrace) {
  Cluster prompt(small_study(100, 2));
  prompt.add_worker(1);
  prompt.start();
  prompt.run(milliseconds(105));
  prompt.stop();
  const auto requests = prompt.workers[0]->num_requests;
  prompt.run(seconds(10));
  EXPECT_EQ(prompt.core->outcome(), LearnerCore::Outcome::kStopped);
  EXPECT_EQ(prompt.workers[0]->num_requests, requests);
  EXPECT_FALSE(prompt.workers[0]->has_work());
  EXPECT_EQ(prompt.core->counters().applied, requests - 2) << "two starts are evaluated";

  Cluster stuck(small_study(100, 2));
  stuck.add_worker(1, seconds(1000));
  stuck.start();
  stuck.run(seconds(1));
  stuck.stop();
  stuck.run(seconds(4));
  EXPECT_EQ(stuck.core->outcome(), LearnerCore::Outcome::kRunning);
  stuck.run(seconds(2));
  EXPECT_EQ(stuck.core->outcome(), LearnerCore::Outcome::kStopped);
}

TEST(LearnerCoreTest, PublishesADefinitionAgainForAWorkerThatLacksIt) {
  Cluster cluster(small_study(20, 1));
  cluster.start();
  cluster.run(milliseconds(10));  // both definitions go out before any worker is there
  cluster.add_worker(1);
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  int policies = 0;
  for (const protocol::Message& message : cluster.sent) {
    const auto* piece = std::get_if<protocol::DefinitionPiece>(&message);
    policies += piece && piece->name.kind == protocol::DefinitionKind::kPolicy;
  }
  EXPECT_EQ(policies, 2);
}

}  // namespace
}  // namespace treeroll::learner
