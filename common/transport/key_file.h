#pragma once

#include <ctime>
#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/transport/key_ring.h"

namespace treeroll::transport {

/// A file of keys that is looked at again while a daemon runs, so that keys change without a stop.
class KeyFile {
 public:
  /// Fails with one line for a person: who else can read it, which line is no key.
  static Result<KeyFile> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  const KeyRing& keys() const { return keys_; }

  /// Reads it again if it has changed. @return whether keys() may be others; an error, once for
  /// each change, leaves them as they were
  Result<bool> look_again();

 private:
  /// Of the file that was read last.
  struct Stamp {
    std::timespec changed{};
    unsigned long inode = 0;
  };

  explicit KeyFile(std::filesystem::path path) : path_(std::move(path)) {}
  Stamp stamp() const;
  Result<KeyRing> read() const;

  std::filesystem::path path_;
  KeyRing keys_;
  Stamp read_;
};

/// What a program says on the network.
enum class Voice {
  kLearner,  ///< as a learner, or as all there are: a learner's key is needed
  kWorker,   ///< a worker's key will do
};

/// The file of an option, if it is given. Throws ConfigError: it cannot be used, or not for this
/// voice.
std::optional<KeyFile> key_file_of(const std::string& option, const std::filesystem::path& path,
                                   Voice voice);

/// For the log at a start: who is believed.
std::string trust_in_words(const std::optional<KeyFile>& file);

}  // namespace treeroll::transport
