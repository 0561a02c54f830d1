// What a journal tells of roll-outs that were run again, and what is left of it without a worker.
#include "learner/journal/journal_rechecks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "learner/core/run.h"
#include "learner/journal/journal_refold.h"
#include "tests/journal/journal_folder.h"
#include "tests/journal/learnt_study.h"

namespace treeroll {
namespace {

class JournalRechecksTest : public JournalFolderTest {
 protected:
  static AcceptedResult answer(protocol::WorkerId worker, std::int64_t content, double reward) {
    return {{0, -1}, content, Outcome::ok(reward), worker};
  }
  static Study study(double share = 1) {
    Study study;
    study.recheck = share;
    study.repetitions = 4;
    return study;
  }
};

/// Those who know three workers.
class FoldOf {
 public:
  explicit FoldOf(const Study& study) : fold_(study) {
    for (const protocol::WorkerId worker : {1, 2, 3}) {
      fold_.add({.record = KnownWorker{worker, "class", "host" + std::to_string(worker), 7}});
    }
  }
  RecheckFold* operator->() { return &fold_; }
  void add(const JournalRecord& record) { fold_.add({.record = record}); }
  /// Whose result this answer would be compared with; 0: nobody's.
  protocol::WorkerId first_of(const AcceptedResult& second) const {
    const auto first = fold_.first_of({.record = SecondAnswer{second}});
    return first ? first->worker : 0;
  }

 private:
  RecheckFold fold_;
};

/// An extension evaluates its final policies anew, under the numbers of those before.
TEST_F(JournalRechecksTest, AnswersToAQuestionOfBeforeAnExtensionAreNoneToItsSuccessor) {
  const Study known = study();
  FoldOf fold(known);
  fold.add(answer(1, 100, .5));
  fold.add(SecondAnswer{answer(2, 100, .4)});  // disputed, and no third one comes
  fold.add(answer(1, 200, .7));
  EXPECT_EQ(fold.first_of(answer(3, 100, .4)), 0) << "of a question that is not asked any more";
  EXPECT_EQ(fold.first_of(answer(2, 200, .7)), 1);
}

/// Its number is part of a question's content: with more repetitions a run may have another.
TEST_F(JournalRechecksTest, ARunThatIsNumberedAnewIsTheSame) {
  const Study known = study();
  RecheckFold fold(known);
  fold.add({.record = answer(1, 100, .5), .run_then = 3});
  const NumberedRecord later{.record = SecondAnswer{answer(2, 777, .5)}};
  const auto first = fold.first_of(later);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->content, 100);
  EXPECT_EQ(first->run_then, 3);
  EXPECT_FALSE(fold.first_of({.record = later.record, .run_then = 3}));
  fold.add(later);
  EXPECT_EQ(fold.num_open(), 0U);
}

TEST_F(JournalRechecksTest, NobodyIsItsOwnWitness) {
  const Study known = study();
  FoldOf fold(known);
  fold.add(answer(1, 100, .5));
  fold.add(SecondAnswer{answer(2, 100, .4)});
  fold.add(SecondAnswer{answer(2, 100, .4)});
  EXPECT_EQ(fold->num_open(), 1U);
  fold.add(SecondAnswer{answer(3, 100, .4)});
  EXPECT_EQ(fold->num_open(), 0U);
}

AcceptedResult answer_to(int number, protocol::WorkerId worker, double reward) {
  return {{0, number}, 1000 + number, Outcome::ok(reward), worker};
}

/// As the workforce does: what it has given up no answer is compared with.
TEST_F(JournalRechecksTest, TheOldestIsGivenUpForOneTooMany) {
  const Study known = study();
  FoldOf fold(known);
  const int most = static_cast<int>(protocol::kRechecksOpenMax);
  for (int i = 0; i <= most; ++i) fold.add(answer_to(i, 1, .5));
  EXPECT_EQ(fold->num_open(), protocol::kRechecksOpenMax);
  EXPECT_EQ(fold.first_of(answer_to(0, 2, .5)), 0);
  EXPECT_EQ(fold.first_of(answer_to(1, 2, .5)), 1);
}

TEST_F(JournalRechecksTest, OfAHundredThousandThatAreSettledNothingIsHeld) {
  const Study known = study();
  FoldOf fold(known);
  std::size_t most_open = 0;
  for (int i = 0; i < 100'000; ++i) {
    fold.add(answer_to(i, 1, .5));
    if (i >= 10) fold.add(SecondAnswer{answer_to(i - 10, 2, i % 3 == 0 ? .4 : .5)});
    if (i >= 20) fold.add(SecondAnswer{answer_to(i - 20, 3, .5)});
    most_open = std::max(most_open, fold->num_open());
  }
  EXPECT_LE(most_open, 21U);
}

TEST_F(JournalRechecksTest, OnlyWhatTheSeedSaysIsOpened) {
  const Study known = study(.02);
  RecheckFold fold(known);
  std::size_t num_drawn = 0;
  for (int i = 0; i < 5000; ++i) {
    num_drawn += learner::is_rechecked(known, 0, i) ? 1 : 0;
    fold.add({.record = answer_to(i, 1, .5)});
  }
  EXPECT_EQ(fold.num_open(), num_drawn);
  EXPECT_LT(num_drawn, 200U);
}

/// Second answers that confirm what stays are of no use to a fold without some worker.
TEST_F(JournalRechecksTest, AFoldHoldsOnlyTheAnswersThatTakeAPlace) {
  std::ofstream(directory_ / "study.toml") << study_test::tree_study("recheck = 1.0\n");
  learner::LearnerCore core(load_study(directory_ / "study.toml", {}).study,
                            learner::LearnerSettings{});
  learner::Effects unsent;
  core.step({}, learner::Started{}, unsent);
  Refold refold(core, {77});
  for (int i = 0; i < 1000; ++i) {
    const protocol::WorkerId first = i % 100 == 0 ? 77 : 1;
    refold.read_ahead({.record = answer_to(i, first, .5)});
    refold.read_ahead({.record = SecondAnswer{answer_to(i, first == 1 ? 77 : 2, .5)}});
    refold.read_ahead({.record = SecondAnswer{answer_to(i, 3, .5)}});
  }
  EXPECT_EQ(refold.num_held(), 10U);
}

/// Else the study without that worker has had its time, and never learns what is lost.
TEST_F(JournalRechecksTest, TimeSpentOnWhatIsLostDoesNotCount) {
  std::ofstream(directory_ / "study.toml") << study_test::tree_study("stop_after_s = 100\n");
  learner::LearnerCore core(load_study(directory_ / "study.toml", {}).study,
                            learner::LearnerSettings{});
  learner::Effects unsent;
  core.step({}, learner::Started{}, unsent);
  Refold refold(core, {77});
  const auto num_kept = [&](const JournalRecord& record) {
    return refold.next({.record = record}, {}).size();
  };
  EXPECT_EQ(num_kept(LearningTime{std::chrono::seconds(1)}), 1U);
  EXPECT_EQ(num_kept(answer(77, 100, .5)), 0U);
  EXPECT_EQ(num_kept(LearningTime{std::chrono::seconds(100)}), 0U);
}

}  // namespace
}  // namespace treeroll
