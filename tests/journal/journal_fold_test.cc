#include "learner/journal/journal_fold.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/journal/learnt_study.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;

class JournalFoldTest : public testing::Test {
 protected:
  JournalFoldTest() {
    std::string pattern = (fs::temp_directory_path() / "fold.XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    std::ofstream(folder_ / "study.toml") << study_test::tree_study("");
  }
  ~JournalFoldTest() override { fs::remove_all(folder_); }

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

  fs::path folder_;
};

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
