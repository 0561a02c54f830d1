// A study that is learnt for a time: the moment is an event of the journal like a result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "learner/core/learner_core.h"
#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

constexpr Duration kTime = milliseconds(3500);

Study timed_study(bool in_sequence, int num_rollouts = 100'000) {
  Study study = small_study(num_rollouts, 3, 4);
  study.in_sequence = in_sequence;
  study.stop_after = kTime;
  return study;
}

void expect_same_runs(const LearnerCore& a, const LearnerCore& b) {
  const std::vector<RunRecord> runs = a.run_records();
  const std::vector<RunRecord> others = b.run_records();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    ASSERT_EQ(runs[i].rollouts.size(), others[i].rollouts.size());
    for (std::size_t k = 0; k < runs[i].rollouts.size(); ++k) {
      EXPECT_EQ(runs[i].rollouts[k].reward, others[i].rollouts[k].reward);
    }
    EXPECT_EQ(runs[i].final_reward, others[i].final_reward);
    EXPECT_EQ(runs[i].best_policy, others[i].best_policy);
  }
}

/// Learnt to its end by three workers of different speed.
void learn(Cluster& cluster) {
  for (int id = 1; id <= 3; ++id) cluster.add_worker(id, milliseconds(30 + 7 * id));
  cluster.start();
  cluster.run(seconds(1000));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

TEST(LearnerCoreTimeTest, RunsDrawNoMoreThenWhatIsUnderWayIsToldAndTheirPolicyEvaluated) {
  for (const bool in_sequence : {true, false}) {
    Cluster cluster(timed_study(in_sequence));
    std::int64_t issued_at_end = 0;
    for (int id = 1; id <= 3; ++id) cluster.add_worker(id, milliseconds(30 + 7 * id));
    cluster.start();
    cluster.run(seconds(1000), [&] {
      if (cluster.now <= TimePoint(kTime)) issued_at_end = cluster.core->counters().issued;
    });
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    EXPECT_LE(cluster.now, TimePoint(kTime + seconds(1)));
    const LedgerCounters counters = cluster.core->counters();
    EXPECT_EQ(counters.issued, issued_at_end);
    EXPECT_EQ(counters.applied, issued_at_end);
    EXPECT_GT(counters.applied, 100);
    for (const RunRecord& run : cluster.core->run_records()) {
      EXPECT_TRUE(run.final_reward.has_value());
      for (const RolloutRecord& rollout : run.rollouts) EXPECT_EQ(rollout.layer, 1);
    }
    EXPECT_EQ(cluster.times.rbegin()->second.elapsed, kTime);
    EXPECT_THAT(cluster.log, Contains(Field(&LogLine::text, HasSubstr("time of 3.5 s is up"))));
  }
}

TEST(LearnerCoreTimeTest, TheFoldOfTheJournalStopsAtTheSamePlace) {
  for (const bool in_sequence : {true, false}) {
    const Study study = timed_study(in_sequence);
    Cluster whole(study);
    learn(whole);
    Cluster folded(study);
    folded.start();
    folded.recover(whole.journal, whole.times);
    ASSERT_EQ(folded.core->outcome(), LearnerCore::Outcome::kDone);
    expect_same_runs(*folded.core, *whole.core);

    if (in_sequence) continue;  // where the next result may only be held
    auto later = whole.times;
    const auto end = std::prev(later.end());
    const LearningTime time = end->second;
    const std::size_t place = end->first;
    later.erase(end);
    later[place + 1] = time;
    Cluster moved(study);
    moved.start();
    moved.recover(whole.journal, later);
    EXPECT_EQ(moved.core->outcome(), LearnerCore::Outcome::kFailed);
  }
}

TEST(LearnerCoreTimeTest,
     ResumedAtAnyPlaceItEndsTheSameOnceTheTimeWasUpAndElseInTheTimeThatWasLeft) {
  const Study study = timed_study(/*in_sequence=*/true);
  Cluster whole(study);
  learn(whole);
  const std::size_t end = whole.times.rbegin()->first;
  for (std::size_t kept = 0; kept <= whole.journal.size(); kept += kept + 40 < end ? 40 : 1) {
    std::map<std::size_t, LearningTime> times;
    for (const auto& [place, time] : whole.times) {
      if (place <= kept) times[place] = time;
    }
    const bool was_up = kept >= end;
    Cluster resumed(study);
    resumed.now = TimePoint(std::chrono::hours(5));
    const TimePoint start = resumed.now;
    for (int id = 11; id <= 13; ++id) resumed.add_worker(id, milliseconds(20));
    resumed.start();
    resumed.recover(
        {whole.journal.begin(), whole.journal.begin() + static_cast<std::ptrdiff_t>(kept)}, times);
    resumed.run(seconds(1000));
    ASSERT_EQ(resumed.core->outcome(), LearnerCore::Outcome::kDone) << kept;
    if (was_up) {
      EXPECT_TRUE(resumed.times.empty()) << "it is up once";
      expect_same_runs(*resumed.core, *whole.core);
    } else {
      const Duration counted = times.empty() ? Duration{} : times.rbegin()->second.elapsed;
      EXPECT_EQ(resumed.times.rbegin()->second.elapsed, kTime);
      EXPECT_LE(resumed.now - start, kTime - counted + seconds(1)) << kept;
    }
  }
}

TEST(LearnerCoreTimeTest, ResultsThatAreHeldWhenTheTimeIsUpAreToldOnceTheLowerOnesAreIn) {
  Study study = small_study(1000, 1, 4);
  study.stop_after = kTime;
  Cluster cluster(study, /*knows_task=*/true, /*repeatable=*/false);
  cluster.add_worker(1, seconds(60));  // has the start and the first
  cluster.start();
  cluster.run(milliseconds(20));
  ASSERT_EQ(cluster.workers[0]->num_requests, 2) << "the start and the first roll-out";
  cluster.workers[0]->draining = true;  // and takes no other
  cluster.run(milliseconds(200));
  cluster.add_worker(2);
  cluster.run(seconds(30));
  EXPECT_EQ(cluster.core->counters().applied, 0);
  EXPECT_EQ(cluster.times.size(), 1U) << "it is up";
  cluster.run(seconds(100));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  const RunRecord run = cluster.core->run_records()[0];
  EXPECT_EQ(run.rollouts.size(), 4U);
  EXPECT_TRUE(run.final_reward.has_value());
}

TEST(LearnerCoreTimeTest, RunsThatHaveEndedByThenAreAsTheyWere) {
  Study study = timed_study(/*in_sequence=*/true, 20);
  study.conditions.push_back(study.conditions[0]);
  study.conditions[1].name = "long";
  study.conditions[1].exploration.num_rollouts = 100'000;
  Study untimed = study;
  untimed.stop_after.reset();
  untimed.conditions.pop_back();
  Cluster cluster(study);
  learn(cluster);
  Cluster reference(untimed);
  learn(reference);
  const std::vector<RunRecord> runs = cluster.core->run_records();
  const std::vector<RunRecord> expected = reference.core->run_records();
  for (int run = 0; run < 3; ++run) {
    EXPECT_EQ(runs[run].rollouts.size(), 20U);
    EXPECT_EQ(runs[run].final_reward, expected[run].final_reward);
  }
  EXPECT_GT(runs[3].rollouts.size(), 20U);
  EXPECT_LT(runs[3].rollouts.size(), 100'000U);
}

TEST(LearnerCoreTimeTest, AStopNotesTheTimeSoThatNoneIsLost) {
  Cluster cluster(timed_study(true));
  cluster.add_worker(1);
  cluster.start();
  cluster.run(milliseconds(1234));
  cluster.stop();
  cluster.run(seconds(10));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kStopped);
  EXPECT_EQ(TimePoint(cluster.times.rbegin()->second.elapsed), cluster.now);
  EXPECT_GE(cluster.now, TimePoint(milliseconds(1234)));
}

TEST(LearnerCoreTimeTest, TheTimeMayBeUpInTheGraceOfAStop) {
  const Study study = timed_study(true);
  Cluster cluster(study);
  cluster.add_worker(1, seconds(1000));
  cluster.start();
  cluster.run(seconds(2));
  cluster.stop();
  cluster.run(seconds(10));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kStopped);
  EXPECT_EQ(cluster.times.rbegin()->second.elapsed, kTime);
  Cluster resumed(study);
  resumed.add_worker(2);
  resumed.start();
  resumed.recover(cluster.journal, cluster.times);
  resumed.run(seconds(100));
  ASSERT_EQ(resumed.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(resumed.core->counters().applied, 12) << "three runs with four in flight";
}

TEST(LearnerCoreTimeTest, AJournalWhoseTimeDoesNotFitIsRefused) {
  const auto failure_of = [](const Study& study, const std::map<std::size_t, LearningTime>& times) {
    Cluster cluster(study);
    cluster.start();
    cluster.recover({}, times);
    EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kFailed);
    return cluster.core->failure();
  };
  EXPECT_THAT(failure_of(small_study(10, 1), {{0, {seconds(1)}}}), HasSubstr("no stop_after_s"));
  EXPECT_THAT(failure_of(timed_study(true), {{0, {seconds(-1)}}}),
              HasSubstr("counts -1 s of learning after 0 s"));
  Cluster cluster(timed_study(true));
  cluster.start();
  cluster.recover({}, {{0, {seconds(2)}}});
  cluster.recover({}, {{0, {seconds(1)}}});
  EXPECT_THAT(cluster.core->failure(), HasSubstr("counts 1 s of learning after 2 s"));
}

TEST(LearnerCoreTimeTest, AStudyWithoutAnEndInTimeCountsNone) {
  Cluster cluster(small_study(300, 2));
  learn(cluster);
  EXPECT_GT(cluster.now, TimePoint(seconds(1)));
  EXPECT_TRUE(cluster.times.empty());
}

}  // namespace
}  // namespace treeroll::learner
