#include "common/files/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

/// Makes the new name itself durable. A file system that cannot sync a folder says EINVAL: then
/// there is nothing more to be done.
int sync_folder(const std::filesystem::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;
  ::close(descriptor);
  return error;
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path)
    : path_(std::move(path)), temporary_(path_.string() + ".tmp") {
  descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0) fail(errno);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

void AtomicFile::append(std::string_view text) {
  buffer_ += text;
  if (buffer_.size() >= kBufferBytes) flush();
}

void AtomicFile::commit() {
  CHECK(descriptor_ >= 0, "an AtomicFile is committed once");
  flush();
  if (::fsync(descriptor_) != 0) fail(errno);
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail(errno);
  // Renamed: from here on there is no temporary file to remove.
  const int error = ::close(std::exchange(descriptor_, -1)) == 0 ? 0 : errno;
  if (error != 0) fail(error);
  if (const int folder_error = sync_folder(path_.parent_path()); folder_error != 0) {
    fail(folder_error);
  }
}

void AtomicFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(errno);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
}

void AtomicFile::fail(int error) const {
  throw std::runtime_error(
      fmt::format("cannot write {}: {}", path_.string(), std::generic_category().message(error)));
}

void write_atomically(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.append(text);
  file.commit();
}

void copy_durably(const std::filesystem::path& from, const std::filesystem::path& to) {
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

void make_directories_durably(const std::filesystem::path& directory) {
  if (directory.empty() || std::filesystem::is_directory(directory)) return;
  make_directories_durably(directory.parent_path());
  std::error_code error;
  std::filesystem::create_directory(directory, error);
  if (!error) error.assign(sync_folder(directory.parent_path()), std::generic_category());
  if (error) {
    throw std::runtime_error(
        fmt::format("cannot make {}: {}", directory.string(), error.message()));
  }
}

}  // namespace treeroll
