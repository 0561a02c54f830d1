#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace treeroll {

struct NamedText {
  std::string name;  ///< of a file
  std::string_view text;
};

/// A file that appears under its name complete or not at all: it is written beside it as NAME.tmp,
/// synced and renamed. A symbolic link stays and the file it leads to is replaced. What is there
/// and is no regular file, a device or a pipe, is written into as it is, and so is a descriptor of
/// this process ("/dev/stdout", "/dev/fd/3"): of these nobody can take back a part.
/// Every failing call throws std::runtime_error with the path and the system's reason ("cannot
/// write runs/rollouts.csv: No space left on device"), and a file that is never committed leaves
/// nothing behind. One thread.
///
///   AtomicFile file(directory / "runs.csv");
///   file.append(line);
///   file.commit();
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void append(std::string_view text);
  /// Precondition: not committed before.
  void commit();

 private:
  friend void write_atomically(const std::filesystem::path& folder,
                               std::span<const NamedText> files);
  void open_beside(const std::filesystem::path& file);
  void flush();
  void take_name();
  void replace_file();
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;       ///< as given
  std::filesystem::path file_;       ///< what is replaced; empty: written into as it is
  std::filesystem::path temporary_;  ///< beside it
  int descriptor_ = -1;
  std::string buffer_;
};

/// Where a file of this name is written before it has the name: what a process leaves that is ended
/// meanwhile. The next one that writes the file removes it.
std::filesystem::path unfinished(const std::filesystem::path& file);

/// One whole file.
void write_atomically(const std::filesystem::path& path, std::string_view text);
/// Whole files of a folder, each of which appears complete or not at all. Thousands of them take
/// a few waits for the disk, where one by one each takes two: their content is synced with all
/// else that waits for the same file system (syncfs(2)), hundreds at a time, and their names with
/// one sync of the folder.
void write_atomically(const std::filesystem::path& folder, std::span<const NamedText> files);

/// Copies a file under a name that is not taken yet: when this returns the copy is on stable
/// storage. Throws std::runtime_error with the path and the reason.
void copy_durably(const std::filesystem::path& from, const std::filesystem::path& to);

/// Makes a directory and those above it that are missing, their names on stable storage when this
/// returns. Throws std::runtime_error with the path and the reason.
void make_directories_durably(const std::filesystem::path& directory);

}  // namespace treeroll
