#include "learner/core/hedging.h"

#include <gtest/gtest.h>

namespace treeroll::learner {
namespace {

TimePoint at_s(double s) {
  return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s)));
}

/// Three roll-outs leased at time 0, all to worker 1, which has two evaluators; worker 2 is idle
/// and has two as well.
class HedgingTest : public ::testing::Test {
 protected:
  HedgingTest() {
    for (const protocol::WorkerId id : {1, 2}) {
      WorkerEntry& worker = *workers_.hear(id, at_s(0));
      worker.num_evaluators = 2;
      worker.free_slots = 128;
      worker.receive_buffer_bytes = 4 << 20;
      worker.hearing.note_word(at_s(0), 1);
      worker.hearing.note_echo(1);
    }
    std::vector<Ledger::Assignment> chosen;
    for (int number = 0; number < 3; ++number) {
      Question question;
      question.theta = Eigen::VectorXd::Constant(2, number);
      seal(question, {0, number});
      ledger_.draw({0, number}, question);
      chosen.push_back({static_cast<std::size_t>(number), 1, at_s(1e4)});
    }
    ledger_.lease(at_s(0), chosen);
    for (int number = 0; number < 3; ++number) ledger_.set_batch({0, number}, 1, 2);
  }

  std::vector<int> given_too(double now_s) {
    for (const protocol::WorkerId id : {1, 2}) workers_.hear(id, at_s(now_s));
    std::vector<int> numbers;
    for (const Hedge& hedge : hedges(ledger_, workers_, {at_s(now_s), 0, &tasks_, &times_s_})) {
      EXPECT_EQ(hedge.worker, 2);
      EXPECT_GT(hedge.deadline, at_s(now_s));
      numbers.push_back(hedge.key.number);
    }
    return numbers;
  }

  Ledger ledger_;
  WorkerTable workers_;
  std::map<ContentHash, TaskDescription> tasks_{{ContentHash{}, TaskDescription{}}};
  std::map<ContentHash, double> times_s_{{ContentHash{}, .02}};
};

using Numbers = std::vector<int>;

TEST_F(HedgingTest, WhatIsHeldFarLongerThanItTakesGoesToIdleEvaluators) {
  EXPECT_EQ(given_too(.9), Numbers{});
  EXPECT_FALSE(workers_.find(1)->late);
  EXPECT_EQ(given_too(1.1), (Numbers{0, 1})) << "two evaluators are idle";
  EXPECT_TRUE(workers_.find(1)->late);
}

TEST_F(HedgingTest, WhoHasAnsweredNothingIsGivenNoMoreThanItsRoom) {
  workers_.find(2)->num_evaluators = protocol::kEvaluatorsPerWorkerMax;
  std::vector<Ledger::Assignment> chosen;
  for (int number = 3; number < 100; ++number) {
    ledger_.draw({0, number}, ledger_.find({0, 2})->question);
    chosen.push_back({static_cast<std::size_t>(number - 3), 1, at_s(1e4)});
  }
  ledger_.lease(at_s(0), chosen);
  EXPECT_EQ(std::ssize(given_too(10)), protocol::kEvaluatorsUnshownMax);
}

TEST_F(HedgingTest, LongRolloutsAreWaitedForLongerButNotQueuedBehindEachOther) {
  times_s_[ContentHash{}] = 30;
  EXPECT_EQ(given_too(.1), (Numbers{2})) << "two run, the third waits";
  EXPECT_FALSE(workers_.find(1)->late) << "that is nobody's fault";
  ledger_.lease_too(at_s(.1), {0, 2}, 2, at_s(1e4));
  EXPECT_EQ(given_too(100), Numbers{});
  EXPECT_EQ(given_too(121), (Numbers{0})) << "one evaluator is idle";
}

TEST_F(HedgingTest, WhereAllAreDoubtfulOneOfThemIsAsked) {
  workers_.find(2)->hearing.note_lost(at_s(0), at_s(0));
  workers_.find(2)->hearing.note_lost(at_s(.1), at_s(.1));
  ASSERT_FALSE(workers_.find(2)->is_first_choice());
  EXPECT_EQ(given_too(1.1), (Numbers{0, 1}));
}

TEST_F(HedgingTest, WhoHasNothingIsNotLate) {
  workers_.find(2)->late = true;
  given_too(.1);
  EXPECT_TRUE(workers_.find(2)->late) << "it has never answered anything";
  workers_.find(2)->num_accepted = 1;
  given_too(.1);
  EXPECT_FALSE(workers_.find(2)->late);
}

TEST_F(HedgingTest, NothingIsStartedTwiceThatMustNotBe) {
  tasks_[ContentHash{}].repeatable = false;
  EXPECT_EQ(given_too(1000), Numbers{});
}

TEST_F(HedgingTest, WhileNoDurationIsKnownTenSecondsAreLate) {
  times_s_.clear();
  EXPECT_EQ(given_too(.9), Numbers{});
  EXPECT_EQ(given_too(1.1), (Numbers{2})) << "it waits in a queue";
  EXPECT_EQ(given_too(10.1), (Numbers{0, 1}));
}

TEST_F(HedgingTest, ACopyOfWhatHasBeenAnsweredKeepsAnEvaluatorBusy) {
  ledger_.lease_too(at_s(0), {0, 0}, 2, at_s(1e4));
  ledger_.lease_too(at_s(0), {0, 1}, 2, at_s(1e4));
  ledger_.close({0, 0}, 1);
  ledger_.close({0, 1}, 1);
  EXPECT_EQ(given_too(1000), Numbers{}) << "worker 2 has both yet";
  ledger_.forget_copy({0, 0}, 2);
  EXPECT_EQ(given_too(1000), (Numbers{2}));
}

}  // namespace
}  // namespace treeroll::learner
