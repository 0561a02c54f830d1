// A share of the roll-outs is run again on another worker (study.recheck).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/learner_core/second_answers.h"

namespace treeroll::learner {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

std::vector<double> applied_rewards_of(const Cluster& cluster) {
  std::vector<double> rewards;
  for (const Run& run : cluster.core->runs()) {
    for (const RolloutRecord& rollout : run.rollouts()) rewards.push_back(rollout.reward);
  }
  return rewards;
}

TEST(SecondAnswersTest, EachRollOutIsAnsweredByAnotherWorkerAndNothingElseChanges) {
  Cluster plain(small_study(30, 2));
  add_workers(plain, 3);
  plain.start();
  plain.run(hours(1));
  Cluster checked(checked_study());
  add_workers(checked, 3);
  checked.start();
  checked.run(hours(1));
  ASSERT_EQ(checked.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(applied_rewards_of(checked), applied_rewards_of(plain));
  EXPECT_EQ(checked.core->counters().issued, plain.core->counters().issued);
  EXPECT_EQ(checked.core->counters().applied, plain.core->counters().applied);
  EXPECT_EQ(checked.core->counters().conflicting, 0);
  EXPECT_EQ(checked.core->counters().unasked, 0);
  // The start and the final policy of each run, too.
  EXPECT_EQ(checked.second_answers.size(), 2 * (30U + 2U));
  std::map<std::pair<protocol::RolloutKey, std::int64_t>, protocol::WorkerId> first;
  for (const AcceptedResult& result : checked.journal) {
    first[{result.key, result.content}] = result.worker_id;
  }
  for (const SecondAnswer& answer : checked.second_answers) {
    const auto found = first.find({answer.result.key, answer.result.content});
    ASSERT_NE(found, first.end()) << "the same question";
    EXPECT_NE(found->second, answer.result.worker_id) << "another worker";
  }
  EXPECT_EQ(record_of(checked).num_rechecked, 64);
  EXPECT_EQ(record_of(checked).num_disputed, 0);
}

TEST(SecondAnswersTest, AnotherHostIsAskedWhereThereIsAChoiceAndTheSameOneElse) {
  const auto hosts_of = [](const Cluster& cluster) {
    std::map<protocol::WorkerId, std::string> hosts;
    for (const KnownWorker& known : cluster.notes) hosts[known.worker_id] = known.host;
    return hosts;
  };
  const auto num_on_one_host = [&](const Cluster& cluster) {
    std::map<std::pair<protocol::RolloutKey, std::int64_t>, std::string> first;
    auto hosts = hosts_of(cluster);
    for (const AcceptedResult& result : cluster.journal) {
      first[{result.key, result.content}] = hosts[result.worker_id];
    }
    return std::ranges::count_if(cluster.second_answers, [&](const SecondAnswer& answer) {
      return first.at({answer.result.key, answer.result.content}) == hosts[answer.result.worker_id];
    });
  };
  const Study study = checked_study();
  Cluster two(study);
  add_workers(two, 4);
  for (const std::size_t place : {0U, 1U}) two.workers[place]->host = "a";
  for (const std::size_t place : {2U, 3U}) two.workers[place]->host = "b";
  two.start();
  two.run(hours(1));
  ASSERT_EQ(two.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(two.second_answers.size(), 2 * (30U + 2U));
  EXPECT_EQ(num_on_one_host(two), 0);
  Cluster one(study);
  add_workers(one, 4);
  for (const auto& worker : one.workers) worker->host = "a";
  one.start();
  one.run(hours(1));
  ASSERT_EQ(one.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(num_on_one_host(one), std::ssize(one.second_answers)) << "nobody else is there";
  EXPECT_EQ(one.second_answers.size(), two.second_answers.size());
  EXPECT_LT(to_seconds(one.now - TimePoint{}), 1.1 * to_seconds(two.now - TimePoint{}));
}

TEST(SecondAnswersTest, TheShareIsOfTheRollOutsThatTheSeedSays) {
  Cluster cluster(checked_study(.3));
  add_workers(cluster, 2);
  cluster.start();
  cluster.run(hours(1));
  std::set<protocol::RolloutKey> asked;
  for (const SecondAnswer& answer : cluster.second_answers) asked.insert(answer.result.key);
  std::set<protocol::RolloutKey> drawn;
  for (const AcceptedResult& result : cluster.journal) {
    if (is_rechecked(cluster.core->study(), result.key.run, result.key.number)) {
      drawn.insert(result.key);
    }
  }
  EXPECT_EQ(asked, drawn);
  EXPECT_GT(drawn.size(), 5U);
  EXPECT_LT(drawn.size(), 40U);
}

TEST(SecondAnswersTest, OneWorkerAloneEndsTheStudyWithoutThem) {
  Cluster cluster(checked_study());
  add_workers(cluster, 1);
  cluster.start();
  cluster.run(seconds(20));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(cluster.second_answers.empty());
  EXPECT_EQ(cluster.workers[0]->num_evaluated, 2 * (30 + 2));
}

TEST(SecondAnswersTest, WhoIsSlowIsNotWaitedForForEver) {
  Cluster cluster(checked_study());
  cluster.add_worker(1);
  cluster.add_worker(2, hours(100));
  cluster.start();
  cluster.run(hours(2));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
}

TEST(SecondAnswersTest, WhoLiesIsOutvotedSaidAndWithKeysSetAsideForGood) {
  Cluster cluster(checked_study(), true, true, true);
  add_workers(cluster, 4);
  cluster.workers[2]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(cluster.core->workforce().rechecks().is_outvoted(3));
  for (const protocol::WorkerId sound : {1, 2, 4}) {
    EXPECT_FALSE(cluster.core->workforce().rechecks().is_outvoted(sound));
  }
  EXPECT_TRUE(cluster.core->workforce().workers().all().at(3).set_aside);
  EXPECT_TRUE(is_said(cluster, "worker 3 (host3 pid 3): two others contradict its answer to run"));
  EXPECT_TRUE(is_said(cluster, "it gets no more work of this study"));
  EXPECT_TRUE(is_said(cluster, "one of two workers of the same numeric class is broken"));
  // Two that differ are said once: when a third one has told, who is broken.
  std::map<std::string, int> times;
  for (const LogLine& line : cluster.log) {
    if (line.text.starts_with("run ")) ++times[line.text.substr(0, line.text.find(':'))];
  }
  ASSERT_FALSE(times.empty());
  for (const auto& [rollout, count] : times) EXPECT_EQ(count, 1) << rollout;
  EXPECT_GT(cluster.core->counters().conflicting, 0);
  EXPECT_LT(cluster.workers[2]->num_evaluated, 12) << "found soon";
}

TEST(SecondAnswersTest, WithoutKeysItIsLeftOutForAWhile) {
  Cluster cluster(checked_study());
  add_workers(cluster, 4);
  cluster.workers[2]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1));
  EXPECT_TRUE(cluster.core->workforce().rechecks().is_outvoted(3));
  EXPECT_FALSE(cluster.core->workforce().workers().all().at(3).set_aside);
  EXPECT_TRUE(is_said(cluster, "it gets no work for 60 s"));
}

/// Two that lie alike cost nothing to make up where there are no keys.
TEST(SecondAnswersTest, WithoutKeysNobodyIsLeftOutForLongerThanAMinute) {
  Cluster cluster(checked_study());
  add_workers(cluster, 5);
  cluster.workers[2]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1), [&] {
    const WorkerEntry& worker = cluster.core->workforce().workers().all().at(3);
    ASSERT_TRUE(!worker.distrusted || worker.trusted_again - cluster.now <= seconds(60));
    ASSERT_EQ(worker.num_distrusts, 0);
  });
  EXPECT_GT(record_of(cluster).workers.at(3).num_outvoted, 1);
}

TEST(SecondAnswersTest, TwoProcessesOfABrokenHostDoNotOutvoteSoundWorkers) {
  Cluster cluster(checked_study(), true, true, true);
  add_workers(cluster, 5);
  for (const std::size_t liar : {2U, 3U}) {
    cluster.workers[liar]->reward_factor = .5;
    cluster.workers[liar]->host = "broken";
  }
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  const Rechecks& rechecks = cluster.core->workforce().rechecks();
  for (const protocol::WorkerId sound : {1, 2, 5}) EXPECT_FALSE(rechecks.is_outvoted(sound));
  for (const protocol::WorkerId liar : {3, 4}) EXPECT_TRUE(rechecks.is_outvoted(liar));
}

TEST(SecondAnswersTest, OfTwoWorkersNobodyCanTellWhichLies) {
  Cluster cluster(checked_study());
  add_workers(cluster, 2);
  cluster.workers[1]->reward_factor = .5;
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_FALSE(cluster.core->workforce().rechecks().is_outvoted(1));
  EXPECT_FALSE(cluster.core->workforce().rechecks().is_outvoted(2));
  EXPECT_EQ(record_of(cluster).num_disputed, record_of(cluster).num_rechecked);
  EXPECT_EQ(record_of(cluster).num_undecided, record_of(cluster).num_disputed);
  EXPECT_EQ(record_of(cluster).workers.at(1).num_disagreed,
            record_of(cluster).workers.at(1).num_compared);
}

TEST(SecondAnswersTest, LastBitsOfAnotherClassAreNoDisagreement) {
  Cluster cluster(checked_study(), true, true, true);
  add_workers(cluster, 4);
  cluster.workers[3]->numeric_class = "other";
  cluster.workers[3]->reward_factor = 1 + 1e-9;
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(record_of(cluster).num_disputed, 0) << "last bits";
  EXPECT_GT(record_of(cluster).classes.at({"class", "other"}).num_compared, 0);
  EXPECT_GT(record_of(cluster).classes.at({"class", "other"}).difference_max, 0);
}

TEST(SecondAnswersTest, AClassThatDiffersIsReportedAndNotSetAside) {
  Cluster cluster(checked_study(), true, true, true);
  add_workers(cluster, 4);
  cluster.workers[3]->numeric_class = "other";
  cluster.workers[3]->reward_factor = .9;
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_GT(record_of(cluster).num_disputed, 0);
  EXPECT_GT(record_of(cluster).classes.at({"class", "other"}).num_disagreed, 0);
  EXPECT_TRUE(is_said(cluster, "they are not of one numeric class"));
  for (const auto& [id, tally] : record_of(cluster).workers) EXPECT_EQ(tally.num_outvoted, 0);
}

/// Nothing is learnt from second answers, so no bits depend on who gave them.
TEST(SecondAnswersTest, ResultsByClassAreThoseOfFirstAnswers) {
  Cluster cluster(checked_study());
  add_workers(cluster, 3);
  cluster.start();
  cluster.run(hours(1));
  std::int64_t num_results = 0;
  for (const auto& [name, count] : cluster.core->workforce().classes().counts()) {
    num_results += count;
  }
  EXPECT_EQ(num_results, static_cast<std::int64_t>(cluster.journal.size()));
}

TEST(SecondAnswersTest, ATaskThatMustNotBeStartedTwiceIsNot) {
  Cluster cluster(checked_study(), true, false);
  add_workers(cluster, 3);
  cluster.start();
  cluster.run(hours(1));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(cluster.second_answers.empty());
  EXPECT_TRUE(
      is_said(cluster, "are not run again (study.recheck): its task must not be started twice"));
  int num_evaluated = 0;
  for (const auto& worker : cluster.workers) num_evaluated += worker->num_evaluated;
  EXPECT_EQ(num_evaluated, 2 * (30 + 2));
}

TEST(SecondAnswersTest, NeitherIsOneThatOnlyWorkersDescribeSo) {
  Cluster cluster(checked_study(), false);
  cluster.description =
      R"({"deterministic":false,"input_dim":1,"output_dim":1,"reward_max":1.0,"reward_min":0.0,"time_limit_s":10.0})";
  add_workers(cluster, 3);
  cluster.start();
  cluster.run(hours(1));
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_TRUE(cluster.second_answers.empty());
  EXPECT_TRUE(is_said(cluster, "its task gives one policy different rewards"));
}

/// Its own repetition, or what it had been given twice, is no word of another one.
TEST(SecondAnswersTest, UnderLossNobodyIsItsOwnWitness) {
  Cluster cluster(checked_study());
  cluster.loss = .3;
  add_workers(cluster, 3);
  cluster.start();
  cluster.run(hours(1));
  ASSERT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().unasked, 0);
  EXPECT_EQ(cluster.core->counters().rejected, 0);
  std::set<std::pair<protocol::RolloutKey, protocol::WorkerId>> said;
  for (const AcceptedResult& result : cluster.journal) said.emplace(result.key, result.worker_id);
  for (const SecondAnswer& answer : cluster.second_answers) {
    EXPECT_TRUE(said.emplace(answer.result.key, answer.result.worker_id).second);
  }
}

}  // namespace
}  // namespace treeroll::learner
