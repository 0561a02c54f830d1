// Past each bound of the learner something is refused or waits; nothing grows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "common/numbers/random_stream.h"
#include "common/protocol/limits.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using protocol::kNumericClassesMax;
using protocol::kReasonBytesMax;
using protocol::kRefusalsPerWorkerMax;
using protocol::kStringBytesMax;
using protocol::kWorkersMax;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

int lines_with(const Cluster& cluster, const std::string& words) {
  int count = 0;
  for (const LogLine& line : cluster.log) count += line.text.find(words) != std::string::npos;
  return count;
}

/// Of the last batch that the learner has sent.
std::int64_t take_last_batch(Cluster& cluster) {
  std::int64_t last_batch = 0;
  for (const protocol::Message& message : cluster.sent) {
    const auto* batch = std::get_if<protocol::RolloutBatch>(&message);
    if (batch != nullptr) last_batch = batch->sequence;
  }
  cluster.sent.clear();
  return last_batch;
}

TEST(LearnerLimitsTest, AWorkerTooManyIsRefusedSaidOnceAndServedWhenOneHasLeft) {
  Cluster cluster(small_study(10, 1));
  cluster.start();
  for (std::size_t id = 1; id <= kWorkersMax; ++id) {
    protocol::WorkerStatus idle = FakeWorker(static_cast<int>(id), {}).status(Cluster::kLearner);
    idle.draining = true;
    cluster.give(idle);
    // Who has answered a greeting is a worker, and stays.
    idle.held.front().last_batch = take_last_batch(cluster);
    cluster.give(idle);
  }
  EXPECT_EQ(lines_with(cluster, "is refused"), 0);
  FakeWorker& late = cluster.add_worker(5000);
  cluster.run(seconds(2));
  EXPECT_EQ(lines_with(cluster, "4096 workers are the most that are served"), 1);
  EXPECT_EQ(late.num_requests, 0);
  cluster.run(seconds(100));  // the others have fallen silent
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(lines_with(cluster, "is refused"), 1);
  EXPECT_EQ(late.num_evaluated, 12);
}

/// What malloc has given out in this process.
std::size_t bytes_in_use() { return mallinfo2().uordblks + mallinfo2().hblkhd; }

TEST(LearnerLimitsTest, SendersThatMakeUpWorkersClassesAndReasonsDoNotMakeItGrow) {
  if (bytes_in_use() == 0) GTEST_SKIP() << "this allocator does not count: a sanitizer's";
  Cluster cluster(small_study(20, 1));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(milliseconds(35));
  const RunRecord run = cluster.core->run_records()[0];
  ASSERT_GE(run.rollouts.size(), 2U);
  const std::int64_t num_applied = cluster.core->counters().applied;
  cluster.remove_worker(0);

  RandomStream random(1, 0, 0, RandomPurpose::kPerturbation);
  std::size_t warm_bytes = 0;
  const int num_senders = 12'000;
  for (int i = 0; i < num_senders; ++i) {
    FakeWorker made_up(static_cast<protocol::WorkerId>(random.next_bits() >> 1U), {});
    made_up.draining = true;
    made_up.numeric_class = std::to_string(i) + std::string(protocol::kNameBytesMax - 20, 'x');
    cluster.hear(made_up.status(Cluster::kLearner));
    // A duplicate of what is accepted: it is compared, class by class.
    protocol::RewardBatch batch;
    batch.learner_id = Cluster::kLearner;
    batch.worker_id = static_cast<protocol::WorkerId>(random.next_bits() >> 1U);
    batch.first_index = 1;
    batch.results = {{{0, 0}, 0, 0, Outcome::ok(.1), 1}};
    cluster.hear(batch);
    batch.worker_id = made_up.status(0).worker_id;
    cluster.hear(batch);
    if (i % 50 == 0) cluster.run(milliseconds(50));
    cluster.sent.clear();
    cluster.log.clear();
    if (i == num_senders * 2 / 3) warm_bytes = bytes_in_use();
  }
  EXPECT_LE(bytes_in_use(), warm_bytes + (1U << 20U));
  EXPECT_EQ(cluster.core->counters().applied, num_applied);
}

TEST(LearnerLimitsTest, WhoHasWorkedIsStillInTheSummaryAfterAFloodOfMadeUpWorkers) {
  Cluster cluster(small_study(20, 1));
  cluster.add_worker(9);
  cluster.start();
  cluster.run(milliseconds(55));
  cluster.remove_worker(0);
  for (int id = 100; id < 12'000; ++id) {
    FakeWorker made_up(id, {});
    made_up.draining = true;
    cluster.hear(made_up.status(Cluster::kLearner));
    if (id % 50 == 0) cluster.run(milliseconds(50));
    cluster.sent.clear();
  }
  const std::vector<WorkerRecord> records = cluster.core->worker_records();
  EXPECT_LE(records.size(), 2 * kWorkersMax);
  EXPECT_TRUE(std::any_of(records.begin(), records.end(), [](const WorkerRecord& record) {
    return record.pid == 9 && record.num_accepted > 0;
  }));
}

TEST(LearnerLimitsTest, AClassTooManyComparesWithNothing) {
  Cluster cluster(small_study(10, 2));
  cluster.add_worker(1);
  FakeWorker& worker = cluster.add_worker(2);
  cluster.start();
  cluster.run(milliseconds(35));
  ASSERT_GT(worker.num_evaluated, 0);
  // One that names another class each time.
  const auto duplicate = [&](int index, const std::string& numeric_class) {
    worker.numeric_class = numeric_class;
    cluster.give(worker.status(Cluster::kLearner));
    protocol::RewardBatch batch;
    batch.learner_id = Cluster::kLearner;
    batch.worker_id = 2;
    batch.first_index = index;
    batch.results = {{cluster.journal[0].key, 0, 0, Outcome::ok(.1), 1}};
    cluster.give(batch);
  };
  for (int id = 10; id < 10 + static_cast<int>(kNumericClassesMax); ++id) {
    duplicate(id, std::to_string(id));
  }
  EXPECT_EQ(cluster.core->counters().conflicting, 0);
  duplicate(3000, "class");  // that of the worker whose answer was accepted
  EXPECT_EQ(cluster.core->counters().conflicting, 1);
  duplicate(3001, "one more");
  duplicate(3002, "and another");
  EXPECT_EQ(cluster.core->counters().conflicting, 1);
}

TEST(LearnerLimitsTest, AWorkerThatDescribesTheTaskOtherwiseIsRefusedWithBothValues) {
  Cluster cluster(small_study(10, 1));
  cluster.start();
  protocol::WorkerStatus status = FakeWorker(3, {}).status(Cluster::kLearner);
  cluster.give(status);
  status.held.front().last_batch = take_last_batch(cluster);  // it has read the greeting
  cluster.give(status);
  const ContentHash task = content_hash(small_study(1, 1).conditions[0].task_content);
  std::string description = kDescription;
  cluster.give(protocol::DefinitionReport{3, Cluster::kLearner, task, true, description});
  EXPECT_TRUE(cluster.log.empty() || cluster.log.back().text.find("refuses") == std::string::npos);
  description.replace(description.find("10.0"), 4, "20.0");
  cluster.give(protocol::DefinitionReport{3, Cluster::kLearner, task, true, description});
  ASSERT_FALSE(cluster.log.empty());
  EXPECT_NE(cluster.log.back().text.find(
                "task.described.time_limit_s = 20.0: was 10.0 when the study began"),
            std::string::npos)
      << cluster.log.back().text;
}

TEST(LearnerLimitsTest, AWorkerThatRefusesEverythingIsAskedForNothingUntilThatIsForgotten) {
  // A condition a task: more of them than a worker may refuse.
  Study study = small_study(3, 1);
  for (std::size_t i = 1; i <= kRefusalsPerWorkerMax + 10; ++i) {
    Condition condition = study.conditions[0];
    condition.name += std::to_string(i);
    condition.task_content = R"({"name":"bump","settings":{"i":)" + std::to_string(i) + "}}";
    study.conditions.push_back(condition);
  }
  Cluster cluster(study, /*knows_task=*/false);
  cluster.add_worker(1).refusal = std::string(60'000, 'x');
  cluster.start();
  cluster.run(seconds(10));
  bool says_why = false;
  for (const protocol::Message& message : cluster.sent) {
    const auto* status = std::get_if<protocol::LearnerStatus>(&message);
    if (!status) continue;
    EXPECT_LE(status->waiting_for.size(), kStringBytesMax);
    says_why = says_why || status->waiting_for.find("refuse too much") != std::string::npos;
  }
  EXPECT_TRUE(says_why);
  for (const LogLine& line : cluster.log) EXPECT_LE(line.text.size(), kReasonBytesMax + 200);
  cluster.workers[0]->refusal.clear();
  cluster.run(seconds(200));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

TEST(LearnerLimitsTest, AThousandWorkersThatComeAndGoAreAFewLinesOfTheLog) {
  Cluster cluster(small_study(10, 1));
  cluster.start();
  for (int id = 1; id <= 1000; ++id) {
    FakeWorker worker(id, milliseconds(1));
    cluster.give(worker.status(Cluster::kLearner));
    const protocol::Message greeting = cluster.sent.back();
    for (const protocol::Message& reply : worker.receive(greeting, cluster.now)) {
      cluster.give(reply);
    }
  }
  cluster.run(seconds(100));  // so many may be silent for a while
  EXPECT_EQ(cluster.log.size(), 2U * (LogLimiter::kLinesMax + 1));
  EXPECT_THAT(
      cluster.log,
      Contains(Field(&LogLine::text, HasSubstr("workers that join: 990 more in the last 60"))));
  EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr("workers that leave: 990"))));
}

TEST(LearnerLimitsTest, WhileTheDiskLagsNothingMoreIsAcceptedAndNothingGivenOut) {
  const Study study = small_study(30, 8);
  LearnerSettings settings;
  settings.learner_id = Cluster::kLearner;
  settings.batch_bytes_max = 60000;
  settings.unsynced_results_max = 5;
  settings.known_tasks[study.conditions[0].task_content] = TaskDescription{1, 1, 0, 1, 10, true};
  LearnerCore core(study, settings);
  FakeWorker worker(1, milliseconds(1));
  std::vector<AcceptedResult> journal;
  TimePoint now{};
  std::string waiting;
  const auto step = [&](const Event& event) {
    Effects effects;
    core.step(now, event, effects);
    const std::vector<AcceptedResult> results = results_in(effects);
    journal.insert(journal.end(), results.begin(), results.end());
    for (const protocol::Message& message : messages_in(effects)) {
      worker.receive(message, now);
      if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
        waiting = status->waiting_for;
      }
    }
  };
  const auto work = [&](int rounds) {
    for (int i = 0; i < rounds; ++i) {
      now += milliseconds(10);
      std::vector<protocol::Message> messages;
      while (worker.has_work()) messages.emplace_back(worker.finish(Cluster::kLearner, now));
      messages.emplace_back(worker.status(Cluster::kLearner));
      for (const protocol::Message& message : messages) step(MessageReceived{message});
      step(InboxDrained{});
      if (now >= core.next_deadline()) step(TimerFired{});
    }
  };
  step(Started{});
  step(RecoveryFinished{});
  work(1000);  // ten seconds in which no fdatasync returns
  EXPECT_EQ(journal.size(), 5U);
  EXPECT_FALSE(worker.has_work()) << "it gets nothing more to do";
  EXPECT_THAT(waiting, HasSubstr("the disk lags: 5 results"));
  EXPECT_EQ(core.counters().issued, core.counters().applied + core.counters().pending);

  while (core.outcome() == LearnerCore::Outcome::kRunning) {
    const std::size_t before = journal.size();
    step(SyncBegun{});
    step(JournalSynced{});
    work(3);
    ASSERT_LE(journal.size(), before + 5);
    ASSERT_LT(now, TimePoint(seconds(1000)));
  }
  EXPECT_EQ(core.outcome(), LearnerCore::Outcome::kDone);
  Cluster reference(study);
  reference.add_worker(1);
  reference.start();
  reference.run(seconds(1000));
  for (std::size_t run = 0; run < 8; ++run) {
    EXPECT_EQ(core.run_records()[run].best_reward, reference.core->run_records()[run].best_reward);
    EXPECT_EQ(core.run_records()[run].final_reward,
              reference.core->run_records()[run].final_reward);
  }
}

}  // namespace
}  // namespace treeroll::learner
