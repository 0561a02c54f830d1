#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(LearnerAnswersTest, CountsADuplicateOnceAndAConflictOnlyWithinANumericClass) {
  Cluster cluster(small_study(10, 2));
  cluster.add_worker(1);
  FakeWorker& other = cluster.add_worker(9);
  cluster.start();
  cluster.run(milliseconds(35));
  ASSERT_GT(other.num_evaluated, 0);
  const std::int64_t num_applied = cluster.core->counters().applied;
  ASSERT_GT(num_applied, 0);
  const auto change_class = [&](const char* name) {
    other.numeric_class = name;
    cluster.give(other.status(Cluster::kLearner));
  };
  const std::string own = other.numeric_class;
  change_class("another");
  protocol::RewardBatch again;
  again.learner_id = Cluster::kLearner;
  again.worker_id = 9;
  again.first_index = 100;
  again.results = {{cluster.journal[0].key, 0, 0, Outcome::ok(.123), 1}};
  cluster.give(again);
  EXPECT_EQ(cluster.core->counters().duplicate, 1);
  EXPECT_EQ(cluster.core->counters().conflicting, 0);

  change_class(own.c_str());
  again.first_index = 101;
  cluster.give(again);
  EXPECT_EQ(cluster.core->counters().duplicate, 2);
  EXPECT_EQ(cluster.core->counters().conflicting, 1);
  EXPECT_EQ(cluster.core->counters().applied, num_applied);

  cluster.give(again);  // a repetition of what is acknowledged is not looked at again
  EXPECT_EQ(cluster.core->counters().duplicate, 2);
}

TEST(LearnerAnswersTest, RejectsAnswersToOlderQuestionsAndUnknownRollouts) {
  Cluster cluster(small_study(10, 1));
  FakeWorker worker(9, milliseconds(1));
  cluster.start();
  cluster.give(worker.status(Cluster::kLearner));
  protocol::RewardBatch batch;
  batch.learner_id = Cluster::kLearner;
  batch.worker_id = 9;
  batch.first_index = 1;
  batch.last_batch = 1000;
  batch.results = {{{0, 0}, 0, /*content=*/1, Outcome::ok(.5), 1},
                   {{0, 7}, 0, 0, Outcome::ok(.5), 1},
                   {{5, 0}, 0, 0, Outcome::ok(.5), 1},
                   {{-1, 0}, 0, 0, Outcome::ok(.5), 1}};
  cluster.give(batch);
  // The first is to what has been drawn; nobody was asked the second; there is no such run, nor
  // such an evaluation yet.
  EXPECT_EQ(cluster.core->counters().rejected + cluster.core->counters().unasked, 4);
  EXPECT_EQ(cluster.core->counters().applied, 0);
}

TEST(LearnerAnswersTest, IgnoresAnswersToAnotherIncarnation) {
  Cluster cluster(small_study(10, 1));
  FakeWorker& worker = cluster.add_worker(1);
  cluster.start();
  cluster.run(milliseconds(5));
  ASSERT_TRUE(worker.has_work());
  while (worker.has_work()) cluster.give(worker.finish(Cluster::kLearner + 1, cluster.now));
  EXPECT_EQ(cluster.core->counters().applied, 0);
  cluster.run(seconds(100));
  EXPECT_EQ(cluster.core->counters().applied, 10);  // issued again
  EXPECT_GT(cluster.core->counters().reissued, 0);
}

TEST(LearnerAnswersTest, CountsAFailedRolloutWithRewardZero) {
  Cluster cluster(small_study(10, 1));
  cluster.add_worker(1).result_status = RolloutStatus::kDiverged;
  cluster.start();
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().failed, 10);
  const RunRecord record = cluster.core->run_records()[0];
  for (const RolloutRecord& rollout : record.rollouts) {
    EXPECT_EQ(rollout.reward, 0);
    EXPECT_EQ(rollout.status, RolloutStatus::kDiverged);
  }
}

TEST(LearnerAnswersTest, AcknowledgesTheLastAnswerOfAStudyToo) {
  Cluster cluster(small_study(7, 1));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(100));
  const auto* last = std::get_if<protocol::RolloutBatch>(&cluster.sent.back());
  ASSERT_NE(last, nullptr);
  EXPECT_TRUE(last->rollouts.empty());
  ASSERT_EQ(last->acknowledgements.size(), 1U);
  EXPECT_EQ(last->acknowledgements[0].result_index, 9);  // 7 roll-outs and two evaluations
}

TEST(LearnerAnswersTest, AcknowledgesARepetitionThoughAnOlderBatchCameBeforeTheDiskWasDone) {
  const Study study = small_study(10, 2);
  LearnerSettings settings;
  settings.learner_id = Cluster::kLearner;
  settings.batch_bytes_max = 60000;
  settings.known_tasks[study.conditions[0].task_content] = TaskDescription{1, 1, 0, 1, 10, true};
  LearnerCore core(study, settings);
  FakeWorker worker(1, milliseconds(1));
  Effects effects;
  const auto give = [&](const protocol::Message& message) {
    core.step(TimePoint{}, MessageReceived{message}, effects);
    core.step(TimePoint{}, InboxDrained{}, effects);
  };
  core.step(TimePoint{}, Started{}, effects);
  core.step(TimePoint{}, RecoveryFinished{}, effects);
  give(worker.status(Cluster::kLearner));
  for (std::size_t place = 0; place < messages_in(effects).size(); ++place) {
    const protocol::Message message = messages_in(effects)[place];
    for (const protocol::Message& reply : worker.receive(message, TimePoint{})) give(reply);
  }
  const protocol::RewardBatch one = worker.finish(Cluster::kLearner, TimePoint{});
  const protocol::RewardBatch both = worker.finish(Cluster::kLearner, TimePoint{});
  ASSERT_EQ(both.results.size(), 2U);
  give(both);
  give(one);  // overtaken on its way
  core.step(TimePoint{}, SyncBegun{}, effects);
  core.step(TimePoint{}, JournalSynced{}, effects);
  effects = {};
  give(both);
  EXPECT_TRUE(messages_in(effects).empty()) << "roll-outs may come to go along with";
  core.step(TimePoint(milliseconds(1)), TimerFired{}, effects);
  const std::vector<protocol::Message> sent = messages_in(effects);
  ASSERT_FALSE(sent.empty());
  const auto* batch = std::get_if<protocol::RolloutBatch>(&sent.back());
  ASSERT_NE(batch, nullptr);
  ASSERT_EQ(batch->acknowledgements.size(), 1U);
  EXPECT_EQ(batch->acknowledgements[0].seen_index, 2);
  EXPECT_EQ(batch->acknowledgements[0].result_index, 2);
}

/// A learner and one worker's messages to it, by hand.
class AnswersByHandTest : public ::testing::Test {
 protected:
  AnswersByHandTest() {
    const Study study = small_study(10, 4);
    LearnerSettings settings;
    settings.learner_id = Cluster::kLearner;
    settings.batch_bytes_max = 60000;
    settings.known_tasks[study.conditions[0].task_content] = TaskDescription{1, 1, 0, 1, 10, true};
    core_.emplace(study, settings);
    step(Started{});
    step(RecoveryFinished{});
    hear(worker_.status(Cluster::kLearner));
    for (std::size_t place = 0; place < messages_in(effects_).size(); ++place) {
      const protocol::Message message = messages_in(effects_)[place];
      for (const protocol::Message& reply : worker_.receive(message, now_)) hear(reply);
    }
  }

  void step(const Event& event) { core_->step(now_, event, effects_); }
  void hear(const protocol::Message& message) {
    step(MessageReceived{message});
    step(InboxDrained{});
  }
  /// The last word to the worker, one that was due by then.
  protocol::Acknowledgement word() {
    now_ += milliseconds(20);
    step(TimerFired{});
    std::optional<protocol::Acknowledgement> last;
    for (const protocol::Message& message : messages_in(effects_)) {
      const auto* batch = std::get_if<protocol::RolloutBatch>(&message);
      if (batch && !batch->acknowledgements.empty()) last = batch->acknowledgements.back();
    }
    return last.value_or(protocol::Acknowledgement{});
  }
  /// An answer by itself, under its index.
  protocol::RewardBatch answer() {
    protocol::RewardBatch batch = worker_.finish(Cluster::kLearner, now_);
    batch.first_index += static_cast<std::int64_t>(batch.results.size()) - 1;
    batch.results.erase(batch.results.begin(), batch.results.end() - 1);
    return batch;
  }

  TimePoint now_{};
  FakeWorker worker_{1, milliseconds(1)};
  std::optional<LearnerCore> core_;
  Effects effects_;
};

TEST_F(AnswersByHandTest, AreSeenAtOnceAndSettledOnceTheyAreOnStableStorage) {
  hear(answer());
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 1, 0}));
  step(SyncBegun{});
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 1, 1}));
}

TEST_F(AnswersByHandTest, ThatComeDuringASyncAreSettledByTheNextOne) {
  hear(answer());
  step(SyncBegun{});
  hear(answer());
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 2, 1}));
  step(SyncBegun{});
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 2, 2}));
}

TEST_F(AnswersByHandTest, PastAGapAreAcceptedAndNotSaidToBeSeen) {
  const protocol::RewardBatch lost = answer();
  hear(answer());
  EXPECT_EQ(results_in(effects_).size(), 1U);
  step(SyncBegun{});
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 0, 0}));
  hear(lost);
  EXPECT_EQ(results_in(effects_).size(), 2U);
  step(SyncBegun{});
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 2, 2})) << "the second need not come again";
}

TEST_F(AnswersByHandTest, ThatItsWorkerGivesNoMoreAreNotWaitedFor) {
  answer();
  protocol::RewardBatch second = answer();
  second.oldest_index = 2;
  hear(second);
  step(SyncBegun{});
  step(JournalSynced{});
  EXPECT_EQ(word(), (protocol::Acknowledgement{1, 2, 2}));
}

TEST_F(AnswersByHandTest, SayWhichRequestsWereLostAndTheseAreIssuedAgainAtOnce) {
  ASSERT_GE(core_->counters().issued, 4);
  const std::int64_t reissued_before = core_->counters().reissued;
  protocol::RewardBatch first = answer();
  protocol::RewardBatch with_loss = first;
  with_loss.last_batch += 10;
  with_loss.batches_received = 1;  // none of those with its requests
  hear(with_loss);
  EXPECT_GE(core_->counters().reissued, reissued_before + 1);
}

}  // namespace
}  // namespace treeroll::learner
