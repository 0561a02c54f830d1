// What a task is, where only workers know it: whose word is believed, and whose answers.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <variant>

#include "tests/learner_core/calm.h"

namespace treeroll::learner {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

std::string description(int input_dim, double reward_max) {
  return to_json(TaskDescription{input_dim, 1, 0, reward_max, 10, true, true}).dump();
}

TEST(DescriptionsTest, OneDescriptionThatDoesNotFitEndsNoStudy) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false);
  cluster.add_worker(kStranger).description = description(9, 1);
  cluster.start();
  cluster.run(seconds(20));
  std::string waiting;
  for (const protocol::Message& message : cluster.sent) {
    const auto* status = std::get_if<protocol::LearnerStatus>(&message);
    if (status != nullptr) waiting = status->waiting_for;
  }
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kRunning);
  EXPECT_THAT(waiting, HasSubstr("the task takes 9 inputs"));
  EXPECT_THAT(cluster.log, says("the task takes 9 inputs"));
  cluster.add_worker(1);
  cluster.run(seconds(100));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(all_rewards(*cluster.core), calm(small_study(10, 1), 1).rewards);
}

TEST(DescriptionsTest, NobodyDescribesATaskWhoHasNotAnsweredAGreeting) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false);
  cluster.start();
  const ContentHash task = content_hash(R"({"name":"bump","settings":{}})");
  cluster.give(
      protocol::DefinitionReport{kStranger, Cluster::kLearner, task, true, description(1, 1e9)});
  EXPECT_EQ(cluster.core->workforce().facts_of(task), nullptr);
}

TEST(DescriptionsTest, MostWorkersDecideWhatATaskIsUntilItIsAnswered) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false);
  const ContentHash task = content_hash(R"({"name":"bump","settings":{}})");
  FakeWorker& first = cluster.add_worker(kStranger, hours(1));
  first.description = description(1, 1e9);
  cluster.start();
  cluster.run(milliseconds(500));
  ASSERT_NE(cluster.core->workforce().facts_of(task), nullptr);
  EXPECT_EQ(cluster.core->workforce().facts_of(task)->reward_max, 1e9);
  cluster.add_worker(1);
  cluster.add_worker(2);
  cluster.run(seconds(100));
  EXPECT_EQ(cluster.core->workforce().facts_of(task)->reward_max, 1);
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_THAT(cluster.log, says("most workers describe a task otherwise"));
}

TEST(DescriptionsTest, ATaskIsDescribedInSoManyWaysAndNoMore) {
  Cluster cluster(small_study(10, 1), /*knows_task=*/false);
  const ContentHash task = content_hash(R"({"name":"bump","settings":{}})");
  const int most = static_cast<int>(protocol::kDescriptionsMax);
  // Strangers who describe it each in a way of his own; then two who agree in one more.
  for (int i = 0; i < most; ++i) {
    cluster.add_worker(kStranger + i, hours(1)).description = description(1, 2 + i);
  }
  cluster.start();
  cluster.run(seconds(2));
  for (int i = most; i < most + 2; ++i) {
    cluster.add_worker(kStranger + i, hours(1)).description = description(1, 2 + most);
  }
  cluster.run(seconds(2));
  ASSERT_NE(cluster.core->workforce().facts_of(task), nullptr);
  EXPECT_LT(cluster.core->workforce().facts_of(task)->reward_max, 2 + most);
}

int num_answered_by(const Cluster& cluster, protocol::WorkerId id) {
  return static_cast<int>(std::ranges::count(cluster.journal, id, &AcceptedResult::worker_id));
}

/// It is asked for roll-outs before it has said what their task is, and works on them meanwhile.
TEST(DescriptionsTest, NothingIsLearntFromALateComerThatDescribesTheTaskOtherwise) {
  for (const bool has_all_definitions : {false, true}) {
    Cluster cluster(small_study(60, 2, 4), /*knows_task=*/false);
    cluster.add_worker(1);
    cluster.start();
    cluster.run(milliseconds(300));
    ASSERT_GT(cluster.journal.size(), 2U);
    FakeWorker& other = cluster.add_worker(kStranger, milliseconds(1));
    other.description = description(1, 7);
    other.has_all_definitions = has_all_definitions;
    other.reward_factor = .5;
    cluster.run(seconds(100));
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    EXPECT_GT(other.num_evaluated, 0);
    EXPECT_EQ(num_answered_by(cluster, kStranger), 0);
    EXPECT_EQ(all_rewards(*cluster.core), calm(small_study(60, 2, 4), 1).rewards);
  }
}

/// Its word on the task is lost, or it has had the task from an earlier learner.
TEST(DescriptionsTest, WhoAnswersBeforeItHasDescribedTheTaskIsAskedWhatItIs) {
  Cluster cluster(small_study(60, 2, 4), /*knows_task=*/false);
  cluster.add_worker(1, milliseconds(200));
  cluster.start();
  cluster.run(seconds(1));
  cluster.add_worker(2, milliseconds(1)).has_all_definitions = true;
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_GT(num_answered_by(cluster, 2), 50);
}

TEST(DescriptionsTest, SilenceDoesNotLetInWhoDescribesTheTaskOtherwise) {
  Cluster cluster(small_study(200, 2, 4), /*knows_task=*/false);
  cluster.add_worker(1, milliseconds(100));
  cluster.add_worker(2, milliseconds(100));
  FakeWorker& other = cluster.add_worker(kStranger, milliseconds(1));
  other.description = description(1, 7);
  cluster.start();
  cluster.run(seconds(2));
  cluster.silence(kStranger, seconds(5));
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(other.num_evaluated, 0);
}

}  // namespace
}  // namespace treeroll::learner
