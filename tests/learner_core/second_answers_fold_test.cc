// What a journal tells of roll-outs that were run again: a fold comes to what the learner knew.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "tests/learner_core/second_answers.h"

namespace treeroll::learner {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// Replays the journal into a fresh core, second answers where they stood or behind all results.
std::unique_ptr<LearnerCore> folded(const Cluster& cluster) {
  auto core = std::make_unique<LearnerCore>(cluster.core->study(), LearnerSettings{});
  Effects unsent;
  core->step({}, Started{}, unsent);
  for (const KnownWorker& worker : cluster.notes) core->step({}, WorkerRecovered{worker}, unsent);
  for (const AcceptedResult& result : cluster.journal) {
    core->step({}, ResultRecovered{result}, unsent);
  }
  for (const SecondAnswer& answer : cluster.second_answers) {
    core->step({}, SecondRecovered{answer}, unsent);
  }
  return core;
}

TEST(SecondAnswersFoldTest, AFoldKnowsWhoWasOutvoted) {
  Cluster cluster(checked_study(), true, true, true);
  add_workers(cluster, 4);
  cluster.workers[2]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1));
  const std::unique_ptr<LearnerCore> core = folded(cluster);
  EXPECT_EQ(core->outcome(), LearnerCore::Outcome::kDone) << core->failure();
  EXPECT_TRUE(core->workforce().rechecks().is_outvoted(3));
  EXPECT_EQ(core->workforce().rechecks().record().num_rechecked, record_of(cluster).num_rechecked);
  EXPECT_EQ(core->workforce().rechecks().record().workers.at(3).num_compared,
            record_of(cluster).workers.at(3).num_compared);
}

/// Else what has no second answer to come would push out others in one of the two only.
TEST(SecondAnswersFoldTest, AFoldOpensWhatTheLearnerDid) {
  Cluster cluster(checked_study(), true, false);
  add_workers(cluster, 3);
  cluster.start();
  cluster.run(hours(1));
  EXPECT_EQ(cluster.core->workforce().rechecks().waiting(),
            folded(cluster)->workforce().rechecks().waiting());
}

/// One datagram in its name is enough for that where there are no keys.
TEST(SecondAnswersFoldTest, AFoldComesToTheSameAlsoIfAWorkerSaysAnotherClassLater) {
  Cluster cluster(checked_study());
  add_workers(cluster, 4);
  cluster.workers[2]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1), [&] {
    const auto& workers = record_of(cluster).workers;
    if (workers.contains(3)) cluster.workers[2]->numeric_class = "";
  });
  const RecheckRecord& live = record_of(cluster);
  const std::unique_ptr<LearnerCore> core = folded(cluster);
  const RecheckRecord& fold = core->workforce().rechecks().record();
  EXPECT_GT(live.workers.at(3).num_compared, 4);
  EXPECT_EQ(fold.num_disputed, live.num_disputed);
  EXPECT_EQ(fold.workers.at(3).num_outvoted, live.workers.at(3).num_outvoted);
  EXPECT_EQ(fold.classes.size(), live.classes.size());
}

/// What a journal holds is no word on what the task is.
TEST(SecondAnswersFoldTest, ATaskThatOnlyWorkersKnowIsDescribedAnewAfterAResume) {
  for (const double share : {0., 1.}) {
    Cluster before(checked_study(share), false);
    add_workers(before, 2);
    before.start();
    before.run(milliseconds(250));
    ASSERT_FALSE(before.journal.empty());
    ASSERT_EQ(before.core->outcome(), LearnerCore::Outcome::kRunning);
    Cluster after(checked_study(share), false);
    add_workers(after, 2);
    after.start();
    for (const KnownWorker& worker : before.notes) after.tell(WorkerRecovered{worker});
    after.recover(before.journal);
    after.run(hours(1));
    EXPECT_EQ(after.core->outcome(), LearnerCore::Outcome::kDone);
  }
}

TEST(SecondAnswersFoldTest, ALearnerThatGoesOnGivesTheOutvotedOneNothing) {
  Cluster before(checked_study(), true, true, true);
  add_workers(before, 4);
  before.workers[2]->reward_factor = .5;
  before.start();
  before.run(milliseconds(250));
  ASSERT_TRUE(before.core->workforce().rechecks().is_outvoted(3));
  ASSERT_EQ(before.core->outcome(), LearnerCore::Outcome::kRunning);
  Cluster after(checked_study(), true, true, true);
  add_workers(after, 4);
  after.start();
  for (const KnownWorker& worker : before.notes) after.tell(WorkerRecovered{worker});
  after.recover(before.journal);
  for (const SecondAnswer& answer : before.second_answers) after.tell(SecondRecovered{answer});
  after.run(hours(1));
  EXPECT_EQ(after.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(after.workers[2]->num_evaluated, 0);
}

TEST(SecondAnswersFoldTest, AJournalWithASecondAnswerToWhatHasNoneIsRefused) {
  Cluster cluster(checked_study());
  add_workers(cluster, 2);
  cluster.start();
  cluster.run(hours(1));
  LearnerCore core(cluster.core->study(), LearnerSettings{});
  Effects unsent;
  core.step({}, Started{}, unsent);
  core.step({}, SecondRecovered{cluster.second_answers[5]}, unsent);
  EXPECT_EQ(core.outcome(), LearnerCore::Outcome::kFailed);
  EXPECT_THAT(core.failure(), ::testing::HasSubstr("once more"));

  LearnerCore other(cluster.core->study(), LearnerSettings{});
  other.step({}, Started{}, unsent);
  other.step({}, ResultRecovered{cluster.journal[0]}, unsent);
  SecondAnswer wrong{cluster.journal[0]};
  wrong.result.content += 1;
  wrong.result.worker_id = 99;
  other.step({}, SecondRecovered{wrong}, unsent);
  EXPECT_EQ(other.outcome(), LearnerCore::Outcome::kFailed);
  EXPECT_THAT(other.failure(), ::testing::HasSubstr("asks otherwise"));
}

}  // namespace
}  // namespace treeroll::learner
