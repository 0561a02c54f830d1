#include "learner/results/state_directory.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/base/config_error.h"
#include "common/files/atomic_file.h"
#include "tests/files/scratch_folder.h"

namespace treeroll {
namespace {

void lay(const std::filesystem::path& file, const char* text) { std::ofstream(file) << text; }

/// A unit starts the learner again by the same command, and nobody is there to clear up.
TEST(StateDirectoryTest, WhatALearnerLeavesThatIsKilledWhileItBeginsKeepsNoneOut) {
  const ScratchFolder folder;
  lay(journal_of(folder.path()), "");
  lay(unfinished(study_of(folder.path())), "half a st");
  EXPECT_NO_THROW(check_state_directory(folder.path()));
  write_atomically(study_of(folder.path()), "a study");
  EXPECT_FALSE(std::filesystem::exists(unfinished(study_of(folder.path()))));
  EXPECT_THROW(check_state_directory(folder.path()), ConfigError);
}

TEST(StateDirectoryTest, WhatSomebodyElseHasWrittenIsNotWrittenOver) {
  const ScratchFolder folder;
  lay(folder.path() / "runs.csv.tmp", "");
  EXPECT_THROW(check_state_directory(folder.path()), ConfigError);
}

TEST(StateDirectoryTest, AJournalThatHoldsSomethingIsNotWrittenOver) {
  const ScratchFolder folder;
  lay(journal_of(folder.path()), "something");
  EXPECT_THROW(check_state_directory(folder.path()), ConfigError);
}

}  // namespace
}  // namespace treeroll
