#include "learner/core/ledger.h"
#include "tests/learner_core/moment.h"

#include <gtest/gtest.h>

#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

using protocol::RolloutKey;
using std::chrono::milliseconds;

Question question(double theta, RolloutKey key) {
  Question question;
  question.theta = Eigen::VectorXd::Constant(1, theta);
  seal(question, key);
  return question;
}

Ledger ledger_of(int count) {
  Ledger ledger;
  for (int number = 0; number < count; ++number) {
    ledger.draw({0, number}, question(number, {0, number}));
  }
  return ledger;
}

TEST(LedgerTest, KnowsWhoWasAskedAndForgetsTheFirstPastTheMost) {
  Ledger ledger = ledger_of(1);
  const auto ask = [&](protocol::WorkerId worker) {
    ledger.lease(at(0), {{0, worker, at(50)}});
    ledger.take_back({0, 0}, worker);
  };
  ask(1);
  ask(1);
  EXPECT_TRUE(ledger.find({0, 0})->was_asked(1)) << "its lease is lost, its answer may come";
  EXPECT_FALSE(ledger.find({0, 0})->was_asked(2));
  const auto most = static_cast<protocol::WorkerId>(protocol::kAskedMax);
  for (protocol::WorkerId worker = 2; worker <= most + 1; ++worker) ask(worker);
  EXPECT_FALSE(ledger.find({0, 0})->was_asked(1));
  EXPECT_TRUE(ledger.find({0, 0})->was_asked(most + 1));
  EXPECT_EQ(ledger.find({0, 0})->asked.size(), protocol::kAskedMax);
}

TEST(LedgerTest, LeasesReadyRolloutsOnceInOrder) {
  Ledger ledger = ledger_of(3);
  const auto requests = ledger.lease(at(0), {{0, 7, at(50)}, {2, 8, at(60)}});
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests[0].key, (RolloutKey{0, 0}));
  EXPECT_EQ(requests[0].worker_id, 7);
  EXPECT_EQ(requests[1].key, (RolloutKey{0, 2}));
  ASSERT_EQ(ledger.ready().size(), 1U);
  EXPECT_EQ(ledger.ready()[0], (RolloutKey{0, 1}));
  EXPECT_EQ(ledger.next_deadline(), at(50));
  EXPECT_EQ(ledger.counters.issued, 3);
  EXPECT_EQ(ledger.counters.reissued, 0);
}

TEST(LedgerTest, AnExpiredLeaseComesFirstAndIsCountedWhenIssuedAgain) {
  Ledger ledger = ledger_of(2);
  ledger.lease(at(0), {{0, 7, at(50)}});
  EXPECT_TRUE(ledger.expire(at(49)).empty());
  const auto expired = ledger.expire(at(50));
  ASSERT_EQ(expired.size(), 1U);
  EXPECT_EQ(expired[0].key, (RolloutKey{0, 0}));
  EXPECT_EQ(expired[0].lease.worker, 7);
  EXPECT_TRUE(ledger.leases_of(7).empty());
  EXPECT_EQ(ledger.ready()[0], (RolloutKey{0, 0}));
  const auto again = ledger.lease(at(60), {{0, 8, at(90)}});
  EXPECT_EQ(again[0].attempt, 1);
  EXPECT_EQ(ledger.counters.reissued, 1);
}

TEST(LedgerTest, AHolderThatConfirmsHasItsLeaseExtendedAndIsNewOnce) {
  Ledger ledger = ledger_of(1);
  ledger.lease(at(0), {{0, 7, at(50)}});
  EXPECT_TRUE(ledger.confirm({0, 0}, 7, at(80)));
  EXPECT_FALSE(ledger.confirm({0, 0}, 7, at(90)));
  EXPECT_EQ(ledger.next_deadline(), at(90));
  EXPECT_TRUE(ledger.expire(at(89)).empty());
  EXPECT_TRUE(ledger.expire(at(90))[0].lease.confirmed);
}

TEST(LedgerTest, ARolloutWithTwoHoldersIsReadyOnceBothAreLost) {
  Ledger ledger = ledger_of(2);
  ledger.lease(at(0), {{0, 7, at(50)}});
  EXPECT_EQ(ledger.lease_too(at(10), {0, 0}, 8, at(70)).attempt, 1);
  EXPECT_EQ(ledger.num_leased(), 1U);
  EXPECT_EQ(ledger.expire(at(50))[0].lease.worker, 7);
  EXPECT_EQ(ledger.ready().size(), 1U) << "the second one has it";
  EXPECT_EQ(ledger.find({0, 0})->last_worker, 8);
  ledger.take_back({0, 0}, 8);
  EXPECT_EQ(ledger.ready()[0], (RolloutKey{0, 0}));
}

TEST(LedgerTest, WhoIsNotFirstToAnswerKeepsACopyUntilItIsForgotten) {
  Ledger ledger = ledger_of(1);
  ledger.lease(at(0), {{0, 7, at(50)}});
  ledger.lease_too(at(10), {0, 0}, 8, at(70));
  ledger.close({0, 0}, 8);
  EXPECT_TRUE(ledger.copies_at(8).empty());
  ASSERT_EQ(ledger.copies_at(7).size(), 1U);
  EXPECT_TRUE(ledger.leases_of(7).empty());
  ledger.forget_copy({0, 0}, 7);
  EXPECT_TRUE(ledger.copies_at(7).empty());
}

TEST(LedgerTest, TakesBackWhatWasNeverConfirmed) {
  Ledger ledger = ledger_of(2);
  ledger.lease(at(0), {{0, 7, at(50)}, {1, 7, at(50)}});
  ledger.confirm({0, 1}, 7, at(60));
  ledger.take_back_unconfirmed(7);
  ASSERT_EQ(ledger.ready().size(), 1U);
  EXPECT_EQ(ledger.ready()[0], (RolloutKey{0, 0}));
}

TEST(LedgerTest, ALateAnswerClosesARolloutThatWaitsToBeIssuedAgain) {
  Ledger ledger = ledger_of(2);
  ledger.lease(at(0), {{0, 7, at(50)}});
  ledger.expire(at(50));
  const Ledger::Entry entry = ledger.close({0, 0});
  EXPECT_TRUE(entry.leases.empty());
  EXPECT_EQ(entry.last_worker, 7);
  ASSERT_EQ(ledger.ready().size(), 1U);
  EXPECT_EQ(ledger.ready()[0], (RolloutKey{0, 1}));
  EXPECT_EQ(ledger.find({0, 0}), nullptr);
}

TEST(LedgerTest, AWorkerThatHasLostARolloutIsNotAskedForItsSakeAgain) {
  Ledger ledger = ledger_of(1);
  ledger.lease(at(0), {{0, 7, at(50)}});
  ledger.take_back({0, 0}, 7);
  EXPECT_EQ(ledger.find({0, 0})->last_worker, 7) << "it may have it yet";
  ledger.lease(at(1), {{0, 7, at(50)}});
  ledger.take_back_lost({0, 0}, 7);
  EXPECT_EQ(ledger.find({0, 0})->last_worker, 0);
  EXPECT_EQ(ledger.ready().size(), 1U);
  EXPECT_FALSE(ledger.next_deadline().has_value());
}

TEST(LedgerTest, TheContentNamesEveryPartOfAQuestion) {
  const Question base = question(1, {0, 0});
  EXPECT_EQ(base.content, question(1, {0, 0}).content);
  EXPECT_NE(base.content, question(2, {0, 0}).content);
  EXPECT_NE(base.content, question(1, {0, 1}).content);
  EXPECT_NE(base.content, question(1, {1, 0}).content);
  Question other = base;
  other.task_id.bytes[3] = 1;
  seal(other, {0, 0});
  EXPECT_NE(base.content, other.content);
  other = base;
  other.task_seed = 4;
  seal(other, {0, 0});
  EXPECT_NE(base.content, other.content);
}

TEST(LedgerTest, EvaluationsAreOutsideTheBudget) {
  Ledger ledger;
  ledger.draw({0, -1}, question(1, {0, -1}));
  EXPECT_EQ(ledger.counters.issued, 0);
  EXPECT_NE(ledger.find({0, -1}), nullptr);
}

}  // namespace
}  // namespace treeroll::learner
