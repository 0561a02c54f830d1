// What a journal tells of roll-outs that were run again, and what is left of it without a worker.
#include "learner/journal/journal_rechecks.h"

#include <gtest/gtest.h>

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
  RecheckRecord rechecks_of(const std::vector<JournalRecord>& records) {
    {
      JournalWriter writer(path());
      writer.continue_after({});
      writer.append(JournalStart{.format = kJournalFormat}, 5);
      for (const protocol::WorkerId worker : {1, 2, 3}) {
        writer.append(KnownWorker{worker, "class", "host" + std::to_string(worker), 7}, 5);
      }
      for (const JournalRecord& record : records) writer.append(record, 6);
      writer.sync();
    }
    return *treeroll::rechecks_of(path());
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
