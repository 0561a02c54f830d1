// What anybody on the network may say where nobody has keys, and what comes of it: nothing.
#include <gmock/gmock.h>

#include <functional>
#include <string>
#include <variant>

#include "tests/learner_core/calm.h"

namespace treeroll::learner {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

/// Runs, and gives `hears` each batch with roll-outs as soon as it is sent, once: all on the
/// network hear it. What is said to the cluster meanwhile may make it send more.
void overhear(Cluster& cluster, Duration limit,
              const std::function<void(const protocol::RolloutBatch&)>& hears) {
  std::size_t place = 0;
  cluster.run(limit, [&] {
    for (; place < cluster.sent.size(); ++place) {
      const protocol::Message message = cluster.sent[place];
      const auto* batch = std::get_if<protocol::RolloutBatch>(&message);
      if (batch != nullptr && !batch->rollouts.empty()) hears(*batch);
    }
  });
}

protocol::RewardBatch answer_to(const protocol::RolloutRequest& request, protocol::WorkerId from,
                                double reward, std::int64_t index = 1) {
  protocol::RewardBatch batch;
  batch.worker_id = from;
  batch.learner_id = Cluster::kLearner;
  batch.first_index = index;
  batch.last_batch = 1;
  batch.results = {{request.key, request.attempt, request.content, Outcome::ok(reward), 1}};
  return batch;
}

TEST(StrangersTest, WhoAnswersFirstAndWasNotAskedGivesNoReward) {
  const Study study = small_study(20, 2);
  Cluster cluster(study);
  cluster.add_worker(1);
  cluster.add_worker(2);
  cluster.start();
  std::int64_t index = 0;
  overhear(cluster, seconds(100), [&](const protocol::RolloutBatch& batch) {
    cluster.give(answer_to(batch.rollouts.front(), kStranger, 1, ++index));
  });
  const Calm expected = calm(study, 2);
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(all_rewards(*cluster.core), expected.rewards);
  EXPECT_EQ(cluster.now, expected.end);
  EXPECT_EQ(cluster.core->counters().unasked, index);
  EXPECT_GT(index, 0);
  EXPECT_THAT(cluster.log, says("answers what it was not asked"));
}

TEST(StrangersTest, AWorkerIsBelievedOnlyWhatItWasAsked) {
  const Study study = small_study(20, 2);
  Cluster cluster(study);
  cluster.add_worker(1);
  cluster.add_worker(2);
  cluster.start();
  std::int64_t index = 1000;
  overhear(cluster, seconds(100), [&](const protocol::RolloutBatch& batch) {
    const protocol::RolloutRequest& request = batch.rollouts.front();
    if (request.worker_id == 1) cluster.give(answer_to(request, 2, 1, ++index));
  });
  EXPECT_EQ(all_rewards(*cluster.core), calm(study, 2).rewards);
  EXPECT_EQ(cluster.core->counters().unasked, index - 1000);
  EXPECT_GT(index, 1000);
}

TEST(StrangersTest, ARewardOutOfRangeInAWorkersNameCostsItNoTrust) {
  const Study study = small_study(20, 1);
  Cluster cluster(study);
  cluster.add_worker(1);
  cluster.start();
  bool has_spoken = false;
  overhear(cluster, seconds(100), [&](const protocol::RolloutBatch& batch) {
    if (has_spoken || cluster.core->counters().applied < 3) return;
    has_spoken = true;
    cluster.give(answer_to(batch.rollouts.front(), 1, 1e9, 1'000'000));
  });
  ASSERT_TRUE(has_spoken);
  const Calm expected = calm(study, 1);
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(all_rewards(*cluster.core), expected.rewards);
  EXPECT_LE(to_seconds(cluster.now - TimePoint{}),
            1.5 * to_seconds(expected.end - TimePoint{}) + .2);
  EXPECT_THAT(cluster.log, says("somebody spoke in its name"));
  EXPECT_THAT(cluster.log, Not(says("stands by its reward")));
}

TEST(StrangersTest, WhoStandsByARewardOutOfRangeIsTrustedAgainAfterAWhile) {
  Cluster cluster(small_study(20, 1));
  FakeWorker& worker = cluster.add_worker(1);
  worker.reward_factor = 100;
  cluster.start();
  cluster.run(seconds(30));
  EXPECT_THAT(cluster.log, says("stands by its reward out of range: it gets no work for 60 s"));
  EXPECT_LE(worker.num_evaluated, 2) << "of the two that it had";
  EXPECT_EQ(cluster.core->counters().applied, 0);
  worker.reward_factor = 1;
  cluster.run(seconds(200));
  EXPECT_THAT(cluster.log, says("is trusted again"));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

/// Says that it holds whatever it is given, and never answers.
void add_greedy(Cluster& cluster, protocol::WorkerId id) {
  cluster.add_worker(id, hours(1000)).num_evaluators = protocol::kEvaluatorsPerWorkerMax;
}

TEST(StrangersTest, AMadeUpWorkerOfAThousandEvaluatorsDoesNotStarveAStudy) {
  for (const int num_greedy : {1, 3}) {
    const Study study = small_study(60, 20, 4);
    Cluster cluster(study);
    for (int i = 0; i < num_greedy; ++i) add_greedy(cluster, kStranger + i);
    for (int id = 1; id <= 4; ++id) cluster.add_worker(id);
    cluster.start();
    cluster.run(seconds(1000));
    const Calm expected = calm(study, 4);
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone) << num_greedy;
    EXPECT_EQ(all_rewards(*cluster.core), expected.rewards);
    // While no duration is known ten seconds are late, and forty where two hold it.
    EXPECT_LE(to_seconds(cluster.now - TimePoint{}),
              1.5 * to_seconds(expected.end - TimePoint{}) + 45)
        << num_greedy;
  }
}

TEST(StrangersTest, AWorkersRoomGrowsWithItsAnswers) {
  WorkerEntry worker;
  worker.num_evaluators = 1024;
  EXPECT_EQ(worker.evaluators_shown(), protocol::kEvaluatorsUnshownMax);
  worker.num_accepted = 3;
  EXPECT_EQ(worker.evaluators_shown(), 4 * protocol::kEvaluatorsUnshownMax);
  worker.num_accepted = 1000;
  EXPECT_EQ(worker.evaluators_shown(), 1024);
  worker.num_accepted = 0;
  worker.is_known = true;
  EXPECT_EQ(worker.evaluators_shown(), protocol::kEvaluatorsUnshownMax) << "its key may be stolen";
  WorkerEntry small;
  small.num_evaluators = 8;
  EXPECT_EQ(small.evaluators_shown(), 8);
}

/// Runs, and says in worker 1's name that it refuses the task, once so many answers are in.
void refuse_in_its_name(Cluster& cluster, Duration limit, int num_applied) {
  bool has_spoken = false;
  cluster.run(limit, [&] {
    if (has_spoken || cluster.core->counters().applied < num_applied) return;
    has_spoken = true;
    const ContentHash task = content_hash(R"({"name":"bump","settings":{}})");
    cluster.give(protocol::DefinitionReport{1, Cluster::kLearner, task, false, "no"});
  });
  EXPECT_TRUE(has_spoken);
}

TEST(StrangersTest, ARefusalInAWorkersNameIsForgottenWhenItWorksOnIt) {
  Cluster cluster(small_study(20, 1));
  cluster.add_worker(1, milliseconds(150));  // a status comes while it evaluates
  cluster.start();
  refuse_in_its_name(cluster, seconds(100), 2);
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_LT(cluster.now, TimePoint(seconds(30)));  // a refusal lasts a minute
  EXPECT_THAT(cluster.log, says("works with what it is said to refuse"));
}

/// He hears each lease, and answers it before its worker does, under the index that comes next.
TEST(StrangersTest, WhoAnswersFirstInTheNameOfTheWorkerShows) {
  Cluster cluster(small_study(20, 1));
  cluster.add_worker(1);
  cluster.start();
  std::int64_t index = 0;
  overhear(cluster, seconds(100), [&](const protocol::RolloutBatch& batch) {
    for (const protocol::RolloutRequest& request : batch.rollouts) {
      cluster.give(answer_to(request, 1, .5, ++index));
    }
  });
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_GT(cluster.core->counters().conflicting, 0);
  EXPECT_EQ(cluster.core->counters().duplicate, 0) << "under an index that has been read";
  EXPECT_THAT(cluster.log, says("somebody answers in another one's name"));
}

/// Of index 1, which every later word of the worker reaches, on hearing the lease: the worker's own
/// answer follows, and its status after that holds the roll-out no more.
TEST(StrangersTest, ASoundAnswerClearsItsWorkerOfARewardOutOfRange) {
  for (const bool is_read_before : {false, true}) {
    const Study study = small_study(60, 1);
    Cluster cluster(study);
    cluster.add_worker(1);
    cluster.start();
    int num_spoken = 0;
    overhear(cluster, seconds(100), [&](const protocol::RolloutBatch& batch) {
      const auto num_applied = cluster.core->counters().applied;
      if (is_read_before ? num_applied < 3 : num_spoken > 0) return;
      ++num_spoken;
      cluster.give(answer_to(batch.rollouts.front(), 1, 1e9, 1));
    });
    EXPECT_GT(num_spoken, 0);
    const Calm expected = calm(study, 1);
    ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
    EXPECT_EQ(all_rewards(*cluster.core), expected.rewards);
    EXPECT_LE(to_seconds(cluster.now - TimePoint{}),
              1.1 * to_seconds(expected.end - TimePoint{}) + .05)
        << is_read_before;
    EXPECT_GT(cluster.core->counters().unasked, 0);
    EXPECT_THAT(cluster.log, Not(says("stands by its reward")));
  }
}

TEST(StrangersTest, AGoodAnswerMakesTheNextDistrustShort) {
  Cluster cluster(small_study(40, 1));
  FakeWorker& worker = cluster.add_worker(1);
  cluster.start();
  for (int time = 0; time < 2; ++time) {
    const auto before = cluster.core->counters().applied;
    worker.reward_factor = 1;
    cluster.run(seconds(50), [&] {
      if (cluster.core->counters().applied > before + 3) worker.reward_factor = 100;
    });
  }
  EXPECT_THAT(cluster.log, says("it gets no work for 60 s"));
  EXPECT_THAT(cluster.log, Not(says("it gets no work for 120 s")));
}

/// The worker has done what it holds before its next status: only its answers speak for it.
TEST(StrangersTest, AnAnswerTakesBackARefusalInAWorkersName) {
  Cluster cluster(small_study(40, 1));
  cluster.add_worker(1, milliseconds(3));
  cluster.start();
  refuse_in_its_name(cluster, seconds(50), 5);
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_LT(cluster.now, TimePoint(seconds(10)));
  EXPECT_THAT(cluster.log, says("somebody spoke in its name"));
}

/// Hears `num_names` workers from `first` on in turn, over and over, 200 each 10 ms, while `worker`
/// learns.
void learn_beside_names(Cluster& cluster, protocol::WorkerId worker, protocol::WorkerId first,
                        std::int64_t num_names) {
  std::int64_t next = 0;
  const auto make_up = [&] {
    const protocol::WorkerId id = first + next++ % num_names;
    cluster.hear(FakeWorker(id, milliseconds(1)).status(Cluster::kLearner));
  };
  cluster.start();
  for (std::size_t i = 0; i < protocol::kWorkersMax; ++i) make_up();
  cluster.add_worker(worker);
  TimePoint next_flood{};
  cluster.run(seconds(60), [&] {
    if (cluster.now < next_flood) return;
    next_flood = cluster.now + milliseconds(10);
    for (int i = 0; i < 200; ++i) make_up();
    cluster.sent.clear();
  });
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_LT(cluster.now, TimePoint(seconds(20)));
}

TEST(StrangersTest, ThousandsOfMadeUpWorkersKeepNobodyOut) {
  Cluster cluster(small_study(20, 1));
  learn_beside_names(cluster, 1, 10'000, 1'000'000);
}

/// Who has no key can play what has been signed: a word of each worker that one key has had.
TEST(StrangersTest, ARecordingOfTheWorkersThatOneKeyHasHadKeepsNoneOfItsWorkersOut) {
  Cluster cluster(small_study(20, 1), /*knows_task=*/true, true, /*is_authenticated=*/true);
  constexpr auto kOfOneKey = protocol::WorkerId{7} << protocol::kOwnNameBits;
  learn_beside_names(cluster, kOfOneKey, kOfOneKey + 1, protocol::kWorkersOfOneKeyMax + 6);
}

}  // namespace
}  // namespace treeroll::learner
