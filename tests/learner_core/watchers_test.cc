// What people and programs that watch a learner are told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::SizeIs;

template <class Message>
std::set<int> runs_in(const std::vector<protocol::Message>& messages) {
  std::set<int> runs;
  for (const protocol::Message& message : messages) {
    if (const auto* of_run = std::get_if<Message>(&message)) runs.insert(of_run->run);
  }
  return runs;
}

TEST(WatchersTest, WhoComesLateHearsOfEveryRunAndItsBestPolicyWithinSeconds) {
  Cluster cluster(small_study(50, 10));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(2));
  cluster.remove_worker(0);  // nothing changes any more
  cluster.run(seconds(5));
  cluster.sent.clear();
  cluster.run(seconds(5));
  EXPECT_THAT(runs_in<protocol::RunStatus>(cluster.sent), SizeIs(10));
  EXPECT_THAT(runs_in<protocol::BestPolicy>(cluster.sent), SizeIs(10));
}

/// The names go where people and robots read them, and change no question.
TEST(WatchersTest, PoliciesCarryTheNamesOfSignalsAndWorkersAreSentNone) {
  std::map<bool, std::set<std::int64_t>> contents;
  for (const bool is_named : {false, true}) {
    Study study = small_study(20, 1);
    if (is_named) study.conditions[0].signals = {{"time_s"}, {"force_n"}};
    Cluster cluster(study);
    cluster.add_worker(1);
    cluster.start();
    cluster.run(seconds(60));
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    std::string best;
    for (const protocol::Message& message : cluster.sent) {
      if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
        for (const auto& request : batch->rollouts) contents[is_named].insert(request.content);
      }
      if (const auto* piece = std::get_if<protocol::BestPolicy>(&message)) best = piece->policy;
    }
    const RunRecord run = cluster.core->run_records().at(0);
    for (const std::string& text : {best, run.best_policy, run.final_policy}) {
      EXPECT_EQ(text.find(R"("signals":{"inputs":["time_s"],"outputs":["force_n"]})") !=
                    std::string::npos,
                is_named)
          << text;
    }
  }
  EXPECT_EQ(contents[true], contents[false]);
}

TEST(WatchersTest, TheEndTellsEverythingOnceMore) {
  Study study = small_study(20, 10);
  study.final_evaluations = 3;
  Cluster cluster(study);
  cluster.add_worker(1, std::chrono::milliseconds(1));
  cluster.start();
  cluster.run(seconds(60), [&] {
    if (cluster.core->outcome() == LearnerCore::Outcome::kRunning) cluster.sent.clear();
  });
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_THAT(runs_in<protocol::RunStatus>(cluster.sent), SizeIs(10));
  EXPECT_THAT(runs_in<protocol::BestPolicy>(cluster.sent), SizeIs(10));
  const protocol::LearnerStatus* last = nullptr;
  for (const protocol::Message& message : cluster.sent) {
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) last = status;
  }
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->num_runs_done, 10);
  EXPECT_EQ(last->num_applied, last->num_rollouts);
  EXPECT_EQ(last->num_evaluated, last->num_evaluations);
  EXPECT_EQ(last->host, "here");
  EXPECT_EQ(last->pid, 4321);
}

TEST(WatchersTest, ThousandsOfRunsTakeBoundedBytesAndAllTakeTurns) {
  Cluster cluster(small_study(100, 3000));
  cluster.add_worker(1, std::chrono::milliseconds(4));
  cluster.start();
  cluster.run(std::chrono::milliseconds(500));  // one period in each second from here on
  cluster.sent.clear();
  std::set<int> heard;
  std::set<int> heard_best;
  for (int second = 0; second < 150; ++second) {
    cluster.run(seconds(1));
    std::size_t bytes = 0;
    for (const protocol::Message& message : cluster.sent) {
      const auto* best = std::get_if<protocol::BestPolicy>(&message);
      if (best) bytes += best->policy.size();
      if (best || std::holds_alternative<protocol::RunStatus>(message)) bytes += 150;
    }
    EXPECT_LT(bytes, 140'000U);
    heard.merge(runs_in<protocol::RunStatus>(cluster.sent));
    heard_best.merge(runs_in<protocol::BestPolicy>(cluster.sent));
    cluster.sent.clear();
  }
  EXPECT_THAT(heard, SizeIs(3000));
  for (const RunRecord& run : cluster.core->run_records()) {
    EXPECT_EQ(heard_best.contains(run.run), !run.best_policy.empty()) << run.run;
  }
  EXPECT_GT(heard_best.size(), 2900U);
}

TEST(WatchersTest, ASwitchOfLayersIsLoggedWithRunAndCount) {
  Study study = small_study(60, 1);
  study.conditions[0].start = two_layers();
  study.conditions[0].exploration.last_layer = 2;
  study.conditions[0].exploration.convergence_window = 10;
  study.conditions[0].exploration.convergence_slope = 100;  // whatever the rewards
  Cluster cluster(study);
  cluster.add_worker(1);
  cluster.start();
  cluster.run(seconds(60));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  const auto line = std::find_if(cluster.log.begin(), cluster.log.end(),
                                 [](const LogLine& l) { return l.kind == "layer switches"; });
  ASSERT_NE(line, cluster.log.end());
  EXPECT_THAT(line->text,
              HasSubstr("run 0 (flat, repetition 0): layer 1 is left after 10 roll-outs"));
  EXPECT_THAT(line->text, HasSubstr("layer 2 is explored"));
  EXPECT_EQ(std::count_if(cluster.log.begin(), cluster.log.end(),
                          [](const LogLine& l) { return l.kind == "layer switches"; }),
            1);

  // A learner that folds this has nothing new to say.
  Cluster resumed(study);
  resumed.start();
  resumed.recover({cluster.journal.begin(), cluster.journal.begin() + 30});
  resumed.run(seconds(1));
  for (const LogLine& l : resumed.log) EXPECT_NE(l.kind, "layer switches") << l.text;
}

TEST(WatchersTest, TheJournalSaysWhoAWorkerIsOnceAndHowLongEachRolloutTook) {
  Cluster cluster(small_study(20, 2));
  cluster.add_worker(3);
  cluster.add_worker(4);
  cluster.start();
  cluster.run(seconds(60));
  ASSERT_THAT(cluster.notes, SizeIs(2));
  EXPECT_NE(cluster.notes[0].worker_id, cluster.notes[1].worker_id);
  EXPECT_FALSE(cluster.notes[0].host.empty());
  ASSERT_FALSE(cluster.journal.empty());
  EXPECT_GT(cluster.journal[0].duration_ns.value_or(0), 0);
}

}  // namespace
}  // namespace treeroll::learner
