#include "learner/journal/journal_fold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/files/scratch_folder.h"
#include "tests/journal/learnt_study.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;

class JournalFoldTest : public testing::Test {
 protected:
  JournalFoldTest() { std::ofstream(folder_ / "study.toml") << study_test::tree_study(""); }

  std::string error_of(const fs::path& journal) const {
    const Study study = load_study(folder_ / "study.toml", {}).study;
    learner::LearnerCore core(study, learner::LearnerSettings{});
    try {
      fold_journal(journal, {.id = {}, .repetitions = study.repetitions}, TimePoint{}, core);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "folded";
  }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
};

/// Both forms that version 0.1.0 of treeroll and what came before 0.2.0 have written, and a later.
TEST_F(JournalFoldTest, AnotherVersionOfTheAlgorithmIsNamedWithTheProgramThatGoesOn) {
  const auto error_with = [this](const JournalStart& start) {
    const fs::path journal = folder_ / "versions";
    fs::remove(journal);
    JournalWriter writer(journal);
    writer.append(start, 0);
    writer.flush();
    return error_of(journal);
  };
  EXPECT_EQ(error_with({}), "folded");
  EXPECT_THAT(error_with({.algorithm_version = 1, .format = 1}),
              HasSubstr("was written by version 1 of the algorithm, this program has version 2, "
                        "which gives other bits: go on with treeroll 0.1.0, or learn its "
                        "study.toml anew"));
  EXPECT_THAT(error_with({.algorithm_version = 1, .program = "0.1.7"}),
              HasSubstr("go on with treeroll 0.1.7, or"));
  EXPECT_THAT(error_with({.algorithm_version = 3, .program = "0.9"}),
              HasSubstr("version 3 of the algorithm, this program has version 2, which gives other "
                        "bits: go on with treeroll 0.9, or"));
}

TEST_F(JournalFoldTest, SalvageIsAdvisedOfDamageNotOfWhatCannotBeRead) {
  const fs::path journal = folder_ / "journal";
  EXPECT_EQ(error_of(journal), journal.string() + ": No such file or directory");
  EXPECT_EQ(error_of(folder_), folder_.string() + ": it cannot be read to its end");
  {
    JournalWriter writer(journal);
    for (int i = 0; i < 3; ++i) writer.append(JournalStart{}, 0);
    writer.flush();
  }
  EXPECT_EQ(error_of(journal), "folded");
  std::fstream bytes(journal, std::ios::binary | std::ios::in | std::ios::out);
  bytes.seekp(static_cast<std::streamoff>(fs::file_size(journal) / 2));
  bytes.put('x');
  bytes.close();
  EXPECT_THAT(error_of(journal), HasSubstr("record 1 at byte"));
  EXPECT_THAT(error_of(journal),
              EndsWith("(treeroll-learner --resume DIR --salvage keeps what is before)"));
}

}  // namespace
}  // namespace treeroll
