#include "common/files/atomic_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/files/whole_file.h"
#include "tests/files/scratch_folder.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class AtomicFileTest : public ::testing::Test {
 protected:
  std::size_t num_entries() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
  /// What a write to the path says.
  static std::string error_of(const fs::path& path, const std::string& text = "1,2\n") {
    try {
      write_atomically(path, text);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  ScratchFolder scratch_;
  fs::path folder_ = scratch_.path();
  fs::path file_ = folder_ / "table.csv";
};

/// Both ends of a pipe or a socket pair.
class Ends {
 public:
  explicit Ends(bool socket) {
    const int made =
        socket ? socketpair(AF_UNIX, SOCK_STREAM, 0, ends_.data()) : pipe(ends_.data());
    if (made != 0) throw std::runtime_error("no pipe");
  }
  ~Ends() {
    close(ends_[0]);
    close(ends_[1]);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;

  fs::path input() const { return "/dev/fd/" + std::to_string(ends_[1]); }
  std::string read_some() const {
    std::string text(100, '\0');
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read(ends_[0], text.data(), 100))));
    return text;
  }
  void stop_reading() {
    close(ends_[0]);
    ends_[0] = open("/dev/null", O_RDONLY);
  }

 private:
  std::array<int, 2> ends_{};
};

bool is_device(const fs::path& path) { return fs::is_character_file(fs::symlink_status(path)); }

TEST_F(AtomicFileTest, AppearsWhenItIsCommittedAndLeavesNothingOtherwise) {
  {
    AtomicFile file(file_);
    file.append("never");
  }
  EXPECT_EQ(num_entries(), 0U);
  AtomicFile file(file_);
  file.append("1,2\n");
  EXPECT_FALSE(fs::exists(file_));
  file.commit();
  EXPECT_EQ(read_whole_file(file_), "1,2\n");
  EXPECT_EQ(num_entries(), 1U);
}

TEST_F(AtomicFileTest, ManyAppearTogetherOrNoneOfThoseThatAreWrittenAtOnce) {
  std::vector<NamedText> files;
  for (int i = 0; i < 600; ++i) files.push_back({std::to_string(i), "text"});
  write_atomically(folder_, files);
  EXPECT_EQ(num_entries(), 600U);
  EXPECT_EQ(read_whole_file(folder_ / "599"), "text");
  const std::vector<NamedText> failing{{"one more", "a"}, {std::string(300, 'x'), "b"}};
  EXPECT_THROW(write_atomically(folder_, failing), std::runtime_error);
  EXPECT_EQ(num_entries(), 600U) << "nor is a temporary one left";
  write_atomically(folder_, std::vector<NamedText>{});
}

TEST_F(AtomicFileTest, ALeftOverTemporaryFileIsReplaced) {
  std::ofstream(file_.string() + ".tmp") << "half of a longer table";
  write_atomically(file_, "1,2\n");
  EXPECT_EQ(read_whole_file(file_), "1,2\n");
  EXPECT_EQ(num_entries(), 1U);
}

TEST_F(AtomicFileTest, ALinkAtTheTemporaryNameIsNotWrittenThrough) {
  const fs::path precious = folder_ / "precious";
  std::ofstream(precious) << "precious";
  fs::create_symlink(precious, file_.string() + ".tmp");
  write_atomically(file_, "1,2\n");
  EXPECT_EQ(read_whole_file(precious), "precious");
  EXPECT_EQ(read_whole_file(file_), "1,2\n");
}

TEST_F(AtomicFileTest, AFolderAtTheTemporaryNameIsNamed) {
  fs::create_directory(file_.string() + ".tmp");
  EXPECT_THAT(error_of(file_), HasSubstr("table.csv.tmp cannot be removed"));
}

TEST_F(AtomicFileTest, TwoThatWriteOneFileDoNotMixTheirParts) {
  AtomicFile first(file_);
  first.append("first");
  AtomicFile second(file_);
  second.append("second");
  EXPECT_THROW(first.commit(), std::runtime_error);
  second.commit();
  EXPECT_EQ(read_whole_file(file_), "second");
}

TEST_F(AtomicFileTest, LinksAreFollowedAndTheFileTheyLeadToIsReplaced) {
  fs::create_directory(folder_ / "elsewhere");
  fs::create_symlink("elsewhere/second", file_);
  fs::create_symlink("third", folder_ / "elsewhere" / "second");
  const fs::path third = folder_ / "elsewhere" / "third";
  for (const char* text : {"made", "replaced"}) {
    write_atomically(file_, text);
    EXPECT_TRUE(fs::is_symlink(file_) && fs::is_symlink(folder_ / "elsewhere" / "second"));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(third)));
    EXPECT_EQ(read_whole_file(third), text);
  }
  EXPECT_FALSE(fs::exists(third.string() + ".tmp"));
}

TEST_F(AtomicFileTest, ALinkOfAbsoluteTargetAndALinkToADeviceAreFollowed) {
  fs::create_symlink(folder_ / "target", file_);
  write_atomically(file_, "1,2\n");
  EXPECT_EQ(read_whole_file(folder_ / "target"), "1,2\n");
  fs::create_symlink("/dev/null", folder_ / "link");
  write_atomically(folder_ / "link", "1,2\n");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_TRUE(is_device("/dev/null"));
}

TEST_F(AtomicFileTest, LinksInACircleAndTooManyOfThemAreRefused) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  EXPECT_THAT(error_of(folder_ / "a"), HasSubstr("Too many levels of symbolic links"));
  for (int i = 0; i < 50; ++i) {
    fs::create_symlink(std::to_string(i + 1), folder_ / std::to_string(i));
  }
  EXPECT_THAT(error_of(folder_ / "0"), HasSubstr("Too many levels of symbolic links"));
  EXPECT_EQ(error_of(folder_ / "10"), "");
  EXPECT_EQ(read_whole_file(folder_ / "50"), "1,2\n");
}

TEST_F(AtomicFileTest, DevicesAreWrittenIntoAndStayDevices) {
  EXPECT_EQ(error_of("/dev/null"), "");
  EXPECT_THAT(error_of("/dev/full"), HasSubstr("cannot write /dev/full: No space left on device"));
  EXPECT_TRUE(is_device("/dev/null"));
  EXPECT_TRUE(is_device("/dev/full"));
  EXPECT_FALSE(fs::exists("/dev/null.tmp") || fs::exists("/dev/full.tmp"));
}

TEST_F(AtomicFileTest, ANamedPipeIsWrittenInto) {
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { std::getline(std::ifstream(file_), read, '\0'); });
  write_atomically(file_, "1,2\n");
  reader.join();
  EXPECT_EQ(read, "1,2\n");
  EXPECT_TRUE(fs::is_fifo(file_));
}

TEST_F(AtomicFileTest, DescriptorsOfThisProcessAreWrittenInto) {
  for (const bool socket : {false, true}) {
    const Ends ends(socket);
    write_atomically(ends.input(), "1,2\n");
    EXPECT_EQ(ends.read_some(), "1,2\n");
  }
}

TEST_F(AtomicFileTest, ADescriptorThatAppendsKeepsWhatItsFileHolds) {
  std::ofstream(file_) << "before\n";
  const int descriptor = open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  write_atomically("/proc/self/fd/" + std::to_string(descriptor), "1,2\n");
  close(descriptor);
  EXPECT_EQ(read_whole_file(file_), "before\n1,2\n");
  EXPECT_THAT(error_of("/dev/fd/" + std::to_string(descriptor)), HasSubstr("Bad file descriptor"));
}

TEST_F(AtomicFileTest, AReaderThatHasGoneIsAnError) {
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  Ends ends(false);
  ends.stop_reading();
  EXPECT_THAT(error_of(ends.input()), HasSubstr("Broken pipe"));
  std::signal(SIGPIPE, before);
}

TEST_F(AtomicFileTest, AFolderIsNoFile) {
  EXPECT_THAT(error_of(folder_), HasSubstr("Is a directory"));
}

}  // namespace
}  // namespace treeroll
