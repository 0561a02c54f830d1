#include "common/doctor/group_watch.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>

namespace treeroll::doctor {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr protocol::LearnerId kUs = 77;
const TimePoint kStart{};

GroupWatch make_watch() {
  return GroupWatch({.id = kUs,
                     .version = "0.2.0",
                     .group = "239.255.76.67, port 7667",
                     .batch_bytes_max = 1400});
}

protocol::WorkerStatus status_of(protocol::WorkerId id, const std::string& host) {
  protocol::WorkerStatus status;
  status.worker_id = id;
  status.host = host;
  status.version = "0.2.0";
  status.numeric_class = "x86_64";
  status.num_evaluators = 2;
  status.free_slots = 8;
  return status;
}

protocol::WorkerStatus answer_to(std::int64_t batch, protocol::WorkerStatus status) {
  status.held.push_back({.learner_id = kUs, .last_batch = batch, .last_index = 0, .keys = {}});
  return status;
}

/// The findings on this subject that are not ok.
Findings troubles(const GroupWatch& watch, const std::string& subject) {
  Findings findings = watch.findings();
  std::erase_if(findings, [&](const Finding& finding) {
    return finding.subject != subject || finding.level == Level::kOk;
  });
  return findings;
}

TEST(GroupWatchTest, WithoutAnEchoTheFirewallIsNamedAndNothingElseOfIt) {
  GroupWatch watch = make_watch();
  watch.greeting(kStart);
  watch.longest_batch(kStart);
  const Findings findings = troubles(watch, "echo");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].level, Level::kTrouble);
  EXPECT_THAT(findings[0].cure, HasSubstr("firewall"));
  EXPECT_TRUE(troubles(watch, "length").empty());
}

TEST(GroupWatchTest, LongMessagesThatDoNotComeBackAreTrouble) {
  GroupWatch watch = make_watch();
  const protocol::RolloutBatch small = watch.greeting(kStart);
  const protocol::RolloutBatch large = watch.longest_batch(kStart);
  watch.take(kStart + milliseconds(1), small);
  EXPECT_TRUE(troubles(watch, "echo").empty());
  ASSERT_EQ(troubles(watch, "length").size(), 1U);
  watch.take(kStart + milliseconds(1), large);
  EXPECT_TRUE(troubles(watch, "length").empty());
}

TEST(GroupWatchTest, AnothersBatchIsNoEcho) {
  GroupWatch watch = make_watch();
  protocol::RolloutBatch batch = watch.greeting(kStart);
  batch.learner_id = kUs + 1;
  watch.take(kStart, batch);
  EXPECT_EQ(troubles(watch, "echo").size(), 1U);
}

TEST(GroupWatchTest, AWorkerThatNamesOurBatchHearsUsAndIsGreetedNoMore) {
  GroupWatch watch = make_watch();
  watch.take(kStart, status_of(5, "near"));
  watch.take(kStart, status_of(6, "far"));
  const protocol::RolloutBatch greeting = watch.greeting(kStart);
  ASSERT_EQ(greeting.acknowledgements.size(), 2U);
  EXPECT_TRUE(greeting.rollouts.empty());
  watch.take(kStart, answer_to(greeting.sequence, status_of(5, "near")));
  ASSERT_EQ(watch.greeting(kStart).acknowledgements.size(), 1U);
  for (int i = 0; i < 4; ++i) watch.take(kStart, status_of(6, "far"));
  const Findings deaf = troubles(watch, "worker");
  ASSERT_EQ(deaf.size(), 1U);
  EXPECT_EQ(deaf[0].level, Level::kTrouble);
  EXPECT_THAT(deaf[0].text, HasSubstr("far"));
  EXPECT_THAT(deaf[0].text, HasSubstr("does not hear"));
}

/// It reads no word of who has no learner's key, however well it hears.
TEST(GroupWatchTest, AWorkerThatSignsIsNotCalledDeafByWhoHasNoKey) {
  GroupWatch watch = make_watch();
  const Proof unchecked{.is_unchecked = true};
  watch.take(kStart, status_of(5, "signs"), unchecked);
  EXPECT_TRUE(watch.greeting(kStart).acknowledgements.empty());
  for (int i = 0; i < 9; ++i) watch.take(kStart, status_of(5, "signs"), unchecked);
  const Findings findings = troubles(watch, "worker");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].level, Level::kNotice);
  EXPECT_THAT(findings[0].text, HasSubstr("1 worker with keys: whether"));
  EXPECT_THAT(findings[0].cure, HasSubstr("LEARNER.key"));
}

TEST(GroupWatchTest, ALearnerThatAWorkerOfThisHostRefusesIsTroubleAndSaysWhy) {
  GroupWatch watch = make_watch();
  protocol::LearnerStatus learner;
  learner.learner_id = 9;
  learner.host = "desk";
  watch.take(kStart, learner);
  EXPECT_TRUE(troubles(watch, "learner").empty());
  watch.take(kStart, learner, {.refusal = "learner 9 signs nothing"});
  const Findings findings = troubles(watch, "learner");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].level, Level::kTrouble);
  EXPECT_THAT(findings[0].text, HasSubstr("signs nothing"));
}

TEST(GroupWatchTest, EveryDeafWorkerHasItsTurnAndNoneIsAccusedBefore) {
  GroupWatch watch = make_watch();
  constexpr int kNumDeaf = 120;
  const auto hear_all = [&] {
    for (int i = 1; i <= kNumDeaf; ++i) watch.take(kStart, status_of(i, "deaf"));
  };
  for (int i = 0; i < 10; ++i) hear_all();
  for (const Finding& finding : troubles(watch, "worker")) {
    EXPECT_EQ(finding.level, Level::kNotice) << finding.text;
  }
  std::set<protocol::WorkerId> greeted;
  for (int i = 0; i < 4; ++i) {
    for (const protocol::Acknowledgement& word : watch.greeting(kStart).acknowledgements) {
      greeted.insert(word.worker_id);
    }
  }
  EXPECT_EQ(greeted.size(), static_cast<std::size_t>(kNumDeaf));
}

TEST(GroupWatchTest, WhatAWorkerHoldsForAnotherLearnerIsNoAnswerToUs) {
  GroupWatch watch = make_watch();
  protocol::WorkerStatus status = status_of(5, "near");
  status.held.push_back({.learner_id = kUs + 1, .last_batch = 9, .last_index = 0, .keys = {}});
  watch.take(kStart, status);
  watch.greeting(kStart);
  for (int i = 0; i < 5; ++i) watch.take(kStart, status);
  EXPECT_EQ(troubles(watch, "worker").size(), 1U);
}

TEST(GroupWatchTest, OtherVersionsRestartsAndDeadEvaluatorsAreSaid) {
  GroupWatch watch = make_watch();
  protocol::WorkerStatus old = answer_to(1, status_of(5, "old"));
  old.version = "0.1.0";
  protocol::WorkerStatus ill = answer_to(1, status_of(6, "ill"));
  ill.num_restarts = 3;
  protocol::WorkerStatus dead = answer_to(1, status_of(7, "dead"));
  dead.free_slots = 0;
  for (const protocol::WorkerStatus& status : {old, ill, dead}) watch.take(kStart, status);
  const Findings findings = troubles(watch, "worker");
  const auto said = [&](const std::string& host, const std::string& words) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
      return finding.text.starts_with(host) && finding.text.find(words) != std::string::npos;
    });
  };
  EXPECT_TRUE(said("old", "another version"));
  EXPECT_TRUE(said("ill", "restarted evaluators 3 times"));
  EXPECT_TRUE(said("dead", "no evaluator of it lives"));
}

TEST(GroupWatchTest, ClassesThatMixAreANotice) {
  GroupWatch watch = make_watch();
  protocol::WorkerStatus one = answer_to(1, status_of(5, "a"));
  watch.take(kStart, one);
  EXPECT_TRUE(troubles(watch, "classes").empty());
  protocol::WorkerStatus other = answer_to(1, status_of(6, "b"));
  other.numeric_class = "aarch64";
  watch.take(kStart, other);
  ASSERT_EQ(troubles(watch, "classes").size(), 1U);
  EXPECT_THAT(troubles(watch, "classes")[0].cure, HasSubstr("numeric_class"));
}

TEST(GroupWatchTest, ALearnerThatWaitsIsTroubleWithItsOwnWords) {
  GroupWatch watch = make_watch();
  protocol::LearnerStatus learner;
  learner.learner_id = 9;
  learner.host = "desk";
  learner.study = "swing_up";
  watch.take(kStart, learner);
  EXPECT_TRUE(troubles(watch, "learner").empty());
  learner.waiting_for = "no workers";
  watch.take(kStart, learner);
  ASSERT_EQ(troubles(watch, "learner").size(), 1U);
  EXPECT_THAT(troubles(watch, "learner")[0].text, HasSubstr("no workers"));
}

TEST(GroupWatchTest, ManyWorkersThatAreWellTakeFewLinesAndWhatIsHeardIsBounded) {
  GroupWatch watch = make_watch();
  for (int i = 1; i <= 5000; ++i) watch.take(kStart, answer_to(1, status_of(i, "node")));
  EXPECT_LT(watch.findings().size(), 30U);
  EXPECT_THAT(watch.findings().back().text, HasSubstr("4096 workers"));
}

}  // namespace
}  // namespace treeroll::doctor
