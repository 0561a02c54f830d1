#include "learner/journal/background_sync.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "tests/files/scratch_folder.h"

namespace treeroll {
namespace {

bool is_readable(int descriptor, int wait_ms) {
  pollfd poll_entry{descriptor, POLLIN, 0};
  return poll(&poll_entry, 1, wait_ms) == 1;
}

TEST(BackgroundSyncTest, TellsWhenItIsDoneEachTime) {
  const ScratchFolder folder;
  const int file = open((folder.path() / "file").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  ASSERT_GE(file, 0);
  BackgroundSync sync;
  EXPECT_FALSE(is_readable(sync.done(), 0));
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(write(file, "x", 1), 1);
    sync.begin(file);
    EXPECT_TRUE(sync.is_under_way());
    EXPECT_TRUE(is_readable(sync.done(), 30'000));
    EXPECT_EQ(sync.end(), 0);
    EXPECT_FALSE(sync.is_under_way());
    EXPECT_FALSE(is_readable(sync.done(), 0));
  }
  close(file);
}

TEST(BackgroundSyncTest, SaysWhyASyncHasFailed) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  BackgroundSync sync;
  sync.begin(ends[1]);  // a pipe is on no disk
  EXPECT_EQ(sync.end(), EINVAL);
  for (const int end : ends) close(end);
}

TEST(BackgroundSyncTest, WaitsAtItsEndForWhatIsUnderWay) {
  const ScratchFolder folder;
  const int file = open((folder.path() / "file").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  ASSERT_GE(file, 0);
  { BackgroundSync().begin(file); }
  close(file);
}

}  // namespace
}  // namespace treeroll
