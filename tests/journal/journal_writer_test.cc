#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <fstream>
#include <functional>
#include <stdexcept>

#include "tests/journal/journal_folder.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class JournalWriterTest : public JournalFolderTest {};

TEST_F(JournalWriterTest, GrowsWhileASyncIsUnderWay) {
  {
    JournalWriter writer(path());
    writer.continue_after({});
    writer.append(JournalStart{}, 5);
    writer.begin_sync();
    writer.append(result(0), 6);
    writer.flush();
    pollfd done{writer.sync_done(), POLLIN, 0};
    EXPECT_EQ(poll(&done, 1, 30'000), 1) << "the end of a sync is told";
    writer.end_sync();
    EXPECT_EQ(poll(&done, 1, 0), 0);
    writer.append(result(1), 7);
    writer.begin_sync();
    writer.sync();  // waits for the other
    writer.begin_sync();
  }
  EXPECT_EQ(read()->num_records, 3);
}

TEST_F(JournalWriterTest, OnlyOneWriterAtATime) {
  const JournalWriter first(path());
  EXPECT_THROW(JournalWriter second(path()), std::runtime_error);
}

TEST_F(JournalWriterTest, AFailedWriteIsAnErrorWithItsReason) {
  JournalWriter writer("/dev/full");
  writer.append(JournalStart{}, 1);
  try {
    writer.flush();
    FAIL() << "the write was taken for done";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/dev/full: cannot write the journal: No space left"));
  }
}

/// What another process may do to a journal while a learner writes it, and what is said of it.
struct Touch {
  const char* what;
  std::function<void(const fs::path&)> act;
  const char* says;
};

class TouchedJournalTest : public JournalFolderTest, public ::testing::WithParamInterface<Touch> {};

TEST_P(TouchedJournalTest, IsNoticedAtTheNextSyncAndNothingMoreIsWritten) {
  JournalWriter writer(path());
  writer.continue_after({});
  writer.append(JournalStart{}, 5);
  writer.append(result(0), 6);
  writer.sync();
  GetParam().act(path());
  const bool is_there = fs::exists(path());
  const std::uintmax_t size = is_there ? fs::file_size(path()) : 0;
  writer.append(result(1), 7);
  try {
    writer.sync();
    FAIL() << "it is not noticed";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("journal.lcmlog: another process has "));
    EXPECT_THAT(error.what(), HasSubstr(GetParam().says));
  }
  EXPECT_EQ(fs::exists(path()), is_there);
  EXPECT_EQ(is_there ? fs::file_size(path()) : 0, size);
}

INSTANTIATE_TEST_SUITE_P(
    Ways, TouchedJournalTest,
    ::testing::Values(
        Touch{"cut", [](const fs::path& path) { fs::resize_file(path, 50); },
              "cut the journal: it has 50 bytes, must have"},
        Touch{"written", [](const fs::path& path) { std::ofstream(path, std::ios::app) << "more"; },
              "written to the journal"},
        Touch{"deleted", [](const fs::path& path) { fs::remove(path); }, "deleted the journal"},
        Touch{"moved", [](const fs::path& path) { fs::rename(path, path.string() + ".old"); },
              "moved the journal to another name"},
        Touch{"replaced",
              [](const fs::path& path) {
                fs::copy_file(path, path.string() + ".copy");
                fs::rename(path, path.string() + ".old");
                fs::rename(path.string() + ".copy", path);
              },
              "put another file in the journal's place"}),
    [](const auto& test) { return test.param.what; });

}  // namespace
}  // namespace treeroll
