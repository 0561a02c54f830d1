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
  void write(const std::vector<JournalRecord>& records) {
    JournalWriter writer(path());
    writer.continue_after({});
    writer.append(JournalStart{.format = kJournalFormat}, 5);
    for (const protocol::WorkerId worker : {1, 2, 3}) {
      writer.append(KnownWorker{worker, "class", "host" + std::to_string(worker), 7}, 5);
    }
    for (const JournalRecord& record : records) writer.append(record, 6);
    writer.sync();
  }
  RecheckRecord rechecks_of(const std::vector<JournalRecord>& records) {
    write(records);
    return treeroll::rechecks_of(path(), {.id = {}, .repetitions = 4}, study());
  }
};

/// An extension evaluates its final policies anew, under the numbers of those before.
TEST_F(JournalRechecksTest, AnswersToAQuestionOfBeforeAnExtensionAreNoneToItsSuccessor) {
  const RecheckRecord record = rechecks_of({
      answer(1, 100, .5),
      SecondAnswer{answer(2, 100, .4)},  // disputed, and no third one comes
      answer(1, 200, .7),
      SecondAnswer{answer(3, 100, .4)},  // late: of a question that is not asked any more
      SecondAnswer{answer(2, 200, .7)},
  });
  EXPECT_EQ(record.num_rechecked, 2);
  EXPECT_EQ(record.num_disputed, 1);
  EXPECT_EQ(record.num_undecided, 1);
  for (const auto& [id, tally] : record.workers) EXPECT_EQ(tally.num_outvoted, 0);
}

TEST_F(JournalRechecksTest, NobodyIsItsOwnWitness) {
  const RecheckRecord record = rechecks_of(
      {answer(1, 100, .5), SecondAnswer{answer(2, 100, .4)}, SecondAnswer{answer(2, 100, .4)}});
  EXPECT_EQ(record.workers.at(1).num_compared, 1);
  EXPECT_EQ(record.workers.at(1).num_outvoted, 0);
}

AcceptedResult answer_to(int number, protocol::WorkerId worker, double reward) {
  return {{0, number}, 1000 + number, Outcome::ok(reward), worker};
}

/// As the workforce does: what it has given up no answer is compared with.
TEST_F(JournalRechecksTest, TheOldestIsGivenUpForOneTooMany) {
  std::vector<JournalRecord> records;
  const int most = static_cast<int>(protocol::kRechecksOpenMax);
  for (int i = 0; i <= most; ++i) records.emplace_back(answer_to(i, 1, .5));
  records.emplace_back(SecondAnswer{answer_to(0, 2, .5)});
  records.emplace_back(SecondAnswer{answer_to(1, 2, .5)});
  EXPECT_EQ(rechecks_of(records).num_rechecked, 1);
}

TEST_F(JournalRechecksTest, OfAHundredThousandThatAreSettledNothingIsHeldButCounts) {
  const Study known = study();
  RecheckFold fold(known);
  for (const protocol::WorkerId worker : {1, 2, 3}) {
    fold.add({.record = KnownWorker{worker, "class", "host" + std::to_string(worker), 7}});
  }
  std::size_t most_open = 0;
  for (int i = 0; i < 100'000; ++i) {
    fold.add({.record = answer_to(i, 1, .5)});
    if (i >= 10) fold.add({.record = SecondAnswer{answer_to(i - 10, 2, i % 3 == 0 ? .4 : .5)}});
    if (i >= 20) fold.add({.record = SecondAnswer{answer_to(i - 20, 3, .5)}});
    most_open = std::max(most_open, fold.num_open());
  }
  EXPECT_LE(most_open, 21U);
  EXPECT_EQ(fold.record().num_rechecked, 99'990);
  EXPECT_NEAR(static_cast<double>(fold.record().num_disputed), 33'330, 1);
  EXPECT_NEAR(static_cast<double>(fold.record().workers.at(2).num_outvoted), 33'327, 5);
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
