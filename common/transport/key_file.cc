#include "common/transport/key_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <stdexcept>
#include <utility>

#include "common/base/config_error.h"
#include "common/files/secret_file.h"

namespace treeroll::transport {

KeyFile::Stamp KeyFile::stamp() const {
  struct stat status {};
  if (stat(path_.c_str(), &status) != 0) return {};
  return {status.st_ctim, status.st_ino};
}

Result<KeyRing> KeyFile::read() const {
  try {
    auto keys = KeyRing::parse(read_secret_file(path_, kKeyFileBytesMax));
    if (!keys) return Error{fmt::format("{}: {}", path_.string(), keys.error().message)};
    return keys;
  } catch (const std::runtime_error& error) {
    return Error{error.what()};
  }
}

Result<KeyFile> KeyFile::open(const std::filesystem::path& path) {
  KeyFile file(path);
  file.read_ = file.stamp();
  auto keys = file.read();
  if (!keys) return keys.error();
  file.keys_ = *std::move(keys);
  return file;
}

Result<bool> KeyFile::look_again() {
  const Stamp now = stamp();
  const bool is_same = now.inode == read_.inode && now.changed.tv_sec == read_.changed.tv_sec &&
                       now.changed.tv_nsec == read_.changed.tv_nsec;
  if (is_same) return false;
  read_ = now;
  auto keys = read();
  if (!keys) return keys.error();
  if (keys->is_learners() != keys_.is_learners()) {
    return Error{
        fmt::format("{}: holds keys of the other kind now, learner's or worker's", path_.string())};
  }
  if (!keys_.is_learners() && keys->worker_keys().front().id != keys_.worker_keys().front().id) {
    return Error{
        fmt::format("{}: holds another worker's key now, whose name a running worker "
                    "cannot take (--same-worker-as)",
                    path_.string())};
  }
  keys_ = *std::move(keys);
  return true;
}

std::optional<KeyFile> key_file_of(const std::string& option, const std::filesystem::path& path,
                                   Voice voice) {
  if (path.empty()) return std::nullopt;
  auto file = KeyFile::open(path);
  if (!file) throw ConfigError(option, path.string(), file.error().message);
  if (voice == Voice::kLearner && !file->keys().is_learners()) {
    throw ConfigError(option, path.string(),
                      "must hold a learner's key: it holds a worker's, which can neither speak as "
                      "a learner nor check workers");
  }
  return *std::move(file);
}

std::string trust_in_words(const std::optional<KeyFile>& file) {
  if (!file) {
    return "no --key-file: whoever reaches the group may answer and ask (deploy/doc/security.md)";
  }
  return fmt::format("takes only what is signed with a key of {}", file->path().string());
}

}  // namespace treeroll::transport
