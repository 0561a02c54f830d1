// One learner serves as many workers as it takes, and a message costs it little more for the
// others.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <queue>
#include <set>
#include <tuple>
#include <vector>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;

/// A learner and so many workers, each message handed to those it names alone: the learner's own
/// cost is what is looked at.
class Crowd {
 public:
  Crowd(Study study, int num_workers) {
    LearnerSettings settings;
    settings.learner_id = Cluster::kLearner;
    settings.batch_bytes_max = 60000;
    settings.known_tasks[study.conditions[0].task_content] = TaskDescription{1, 1, 0, 1, 10, true};
    core = std::make_unique<LearnerCore>(std::move(study), settings);
    for (int id = 1; id <= num_workers; ++id) {
      workers_.push_back(std::make_unique<FakeWorker>(id, milliseconds(3)));
      const auto offset = std::chrono::microseconds(1000 * std::int64_t{id} / num_workers);
      due_.push({now_ + offset, id, true});
    }
  }

  void run() {
    step(Started{});
    step(RecoveryFinished{});
    while (core->outcome() == LearnerCore::Outcome::kRunning) {
      const auto [due, id, is_heartbeat] = due_.top();
      const TimePoint deadline = core->next_deadline();
      now_ = std::max(now_, std::min(due, deadline));
      if (deadline <= due) {
        step(TimerFired{});
        continue;
      }
      due_.pop();
      FakeWorker& worker = *workers_[id - 1];
      if (is_heartbeat) {
        due_.push({now_ + milliseconds(200), id, true});
        give(worker.status(Cluster::kLearner));
      } else {
        const protocol::RewardBatch answer = worker.finish(Cluster::kLearner, now_);
        if (worker.has_work()) due_.push({worker.busy_until(), id, false});
        give(answer);
      }
    }
  }

  std::unique_ptr<LearnerCore> core;
  int num_messages = 0;
  Duration spent{};  ///< in the learner

 private:
  void give(const protocol::Message& message) {
    ++num_messages;
    step(MessageReceived{message});
    step(InboxDrained{});
  }

  void step(const Event& event) {
    Effects effects;
    const auto start = std::chrono::steady_clock::now();
    core->step(now_, event, effects);
    if (!results_in(effects).empty()) {
      core->step(now_, SyncBegun{}, effects);
      core->step(now_, JournalSynced{}, effects);
    }
    spent += std::chrono::steady_clock::now() - start;
    for (const protocol::Message& message : messages_in(effects)) {
      const auto* batch = std::get_if<protocol::RolloutBatch>(&message);
      if (!batch) continue;
      std::set<protocol::WorkerId> named;
      for (const auto& request : batch->rollouts) named.insert(request.worker_id);
      for (const auto& acknowledged : batch->acknowledgements) named.insert(acknowledged.worker_id);
      for (const protocol::WorkerId id : named) {
        FakeWorker& worker = *workers_[id - 1];
        const bool had_work = worker.has_work();
        worker.receive(message, now_);
        if (!had_work && worker.has_work()) due_.push({worker.busy_until(), id, false});
      }
    }
  }

  std::vector<std::unique_ptr<FakeWorker>> workers_;
  using Due = std::tuple<TimePoint, protocol::WorkerId, bool>;  // a heartbeat, or else an answer
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
  TimePoint now_{};
};

TEST(ManyWorkersTest, EveryRolloutIsLearntFromOnceWhateverTheNumberOfWorkers) {
  constexpr int kRollouts = 200;
  constexpr int kRepetitions = 100;
  for (const int num_workers : {1, 10, 100, 1000, static_cast<int>(protocol::kWorkersMax)}) {
    Crowd crowd(small_study(kRollouts, kRepetitions, 4), num_workers);
    crowd.run();
    ASSERT_EQ(crowd.core->outcome(), LearnerCore::Outcome::kDone);
    const LedgerCounters counters = crowd.core->counters();
    EXPECT_EQ(counters.applied, kRollouts * kRepetitions);
    EXPECT_EQ(counters.reissued, 0);
    EXPECT_EQ(crowd.core->worker_records().size(), static_cast<std::size_t>(num_workers));
    std::printf("  %4d workers: %.1f us a message, %.1f us a roll-out in the learner core\n",
                num_workers, to_seconds(crowd.spent) * 1e6 / crowd.num_messages,
                to_seconds(crowd.spent) * 1e6 / counters.applied);
  }
}

}  // namespace
}  // namespace treeroll::learner
