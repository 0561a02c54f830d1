#include "common/files/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <deque>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
/// Open at the same time: a quarter of what a process may have open by default.
constexpr std::size_t kFilesAtOnce = 256;
/// As many links as the kernel itself follows.
constexpr int kLinksMax = 40;

/// What cannot be synced, a folder of some file systems or a pipe, says so: then there is nothing
/// more to be done.
int sync(int descriptor) {
  return ::fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno;
}

/// Makes the new name itself durable.
int sync_folder(const fs::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error = sync(descriptor);
  ::close(descriptor);
  return error;
}

/// The number if the path is that of an open descriptor of this process.
std::optional<int> own_descriptor(const fs::path& path) {
  std::error_code error;
  const fs::path folder = fs::canonical(path.parent_path(), error);
  if (error || folder != fmt::format("/proc/{}/fd", ::getpid())) return std::nullopt;
  const std::string name = path.filename();
  int number = -1;
  const char* end = name.data() + name.size();
  const auto [rest, problem] = std::from_chars(name.data(), end, number);
  if (problem != std::errc() || rest != end) return std::nullopt;
  return number;
}

/// Where the links at the end of a path lead, one of our descriptors perhaps: what that is open on
/// may have no name. Nothing if they lead nowhere.
std::optional<fs::path> behind_links(fs::path path) {
  for (int i = 0; i <= kLinksMax; ++i) {
    std::error_code not_a_link;
    const fs::path target = fs::read_symlink(path, not_a_link);
    if (not_a_link || own_descriptor(path)) return path;
    path = path.parent_path() / target;
  }
  return std::nullopt;
}

}  // namespace

AtomicFile::AtomicFile(fs::path path) : path_(std::move(path)) {
  const std::optional<fs::path> end = behind_links(path_);
  if (!end) fail(ELOOP);
  struct stat there {};
  if (const std::optional<int> number = own_descriptor(*end)) {
    // Its own place and its O_APPEND count, which opening it anew would lose.
    descriptor_ = ::fcntl(*number, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  } else if (::stat(path_.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
  } else {
    open_beside(*end);
  }
  if (descriptor_ < 0) fail(errno);
}

void AtomicFile::open_beside(const fs::path& file) {
  file_ = file;
  temporary_ = unfinished(file);
  // One that was left over; and whatever else lies there, a link say, is not written through.
  ::unlink(temporary_.c_str());
  descriptor_ =
      ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (descriptor_ >= 0) return;
  const int error = errno;
  throw std::runtime_error(
      fmt::format("cannot write {}{}: {}", path_.string(),
                  error == EEXIST ? ", for " + temporary_.string() + " cannot be removed" : "",
                  std::generic_category().message(error)));
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (!file_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::append(std::string_view text) {
  buffer_ += text;
  if (buffer_.size() >= kBufferBytes) flush();
}

void AtomicFile::commit() {
  CHECK(descriptor_ >= 0, "an AtomicFile is committed once");
  flush();
  if (const int error = sync(descriptor_); error != 0) fail(error);
  take_name();
  if (file_.empty()) return;
  if (const int folder_error = sync_folder(file_.parent_path()); folder_error != 0) {
    fail(folder_error);
  }
}

/// Precondition: what it holds is on stable storage.
void AtomicFile::take_name() {
  if (!file_.empty()) replace_file();
  // In place: from here on there is no temporary file to remove.
  const int error = ::close(std::exchange(descriptor_, -1)) == 0 ? 0 : errno;
  if (error != 0) fail(error);
}

void AtomicFile::replace_file() {
  // Another program that writes the same file has taken the name since: its part is not ours.
  struct stat ours {};
  struct stat named {};
  if (::fstat(descriptor_, &ours) != 0 || ::lstat(temporary_.c_str(), &named) != 0) fail(errno);
  if (ours.st_ino != named.st_ino || ours.st_dev != named.st_dev) {
    throw std::runtime_error(
        fmt::format("cannot write {}: another program writes it", path_.string()));
  }
  if (::rename(temporary_.c_str(), file_.c_str()) != 0) fail(errno);
}

void AtomicFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EAGAIN) {
      pollfd room{descriptor_, POLLOUT, 0};
      ::poll(&room, 1, -1);
      continue;
    }
    if (written < 0) fail(errno);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
}

void AtomicFile::fail(int error) const {
  throw std::system_error(error, std::generic_category(), "cannot write " + path_.string());
}

fs::path unfinished(const fs::path& file) { return file.string() + ".tmp"; }

void write_atomically(const fs::path& path, std::string_view text) {
  AtomicFile file(path);
  file.append(text);
  file.commit();
}

void write_atomically(const fs::path& folder, std::span<const NamedText> files) {
  while (!files.empty()) {
    const auto group = files.first(std::min(files.size(), kFilesAtOnce));
    files = files.subspan(group.size());
    std::deque<AtomicFile> open;
    for (const NamedText& file : group) {
      open.emplace_back(folder / file.name).append(file.text);
      open.back().flush();
    }
    if (::syncfs(open.back().descriptor_) != 0) open.back().fail(errno);
    for (AtomicFile& file : open) file.take_name();
  }
  if (const int error = sync_folder(folder); error != 0) {
    throw std::system_error(error, std::generic_category(), "cannot write " + folder.string());
  }
}

void copy_durably(const fs::path& from, const fs::path& to) {
  std::ifstream source(from, std::ios::binary);
  AtomicFile copy(to);
  std::string block(kBufferBytes, '\0');
  while (source) {
    source.read(block.data(), static_cast<std::streamsize>(block.size()));
    copy.append(std::string_view(block).substr(0, static_cast<std::size_t>(source.gcount())));
  }
  if (!source.eof()) throw std::runtime_error(fmt::format("cannot read {}", from.string()));
  copy.commit();
}

void make_directories_durably(const fs::path& directory) {
  if (directory.empty() || fs::is_directory(directory)) return;
  make_directories_durably(directory.parent_path());
  std::error_code error;
  fs::create_directory(directory, error);
  if (!error) error.assign(sync_folder(directory.parent_path()), std::generic_category());
  if (error) {
    throw std::runtime_error(
        fmt::format("cannot make {}: {}", directory.string(), error.message()));
  }
}

}  // namespace treeroll
