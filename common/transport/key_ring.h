#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"

namespace treeroll::transport {

using Key = std::array<unsigned char, 32>;

/// What a worker host needs: it says who it is, and knows a learner's words from a stranger's.
struct WorkerKey {
  std::int64_t id = 0;  ///< more than 0; stands in what the worker signs
  Key own{};            ///< it signs with this; the learner signs its words to it with the same
  Key announcements{};  ///< what learners say to all is checked with this
  bool operator==(const WorkerKey&) const = default;
};

/// The keys of one process, newest first: it signs with the first, and takes what is signed with
/// any. Either a learner's, from which those of its workers follow, or a worker's own.
class KeyRing {
 public:
  /// Of a key file: lines of treeroll-keygen, comments after '#'. The error names the line.
  static Result<KeyRing> parse(std::string_view text);

  /// Else it holds a worker's keys.
  bool is_learners() const { return !learner_keys_.empty(); }
  const std::vector<Key>& learner_keys() const { return learner_keys_; }
  const std::vector<WorkerKey>& worker_keys() const { return worker_keys_; }
  /// The name that a worker with this ring may take: `random` but for what it shares with its key.
  std::int64_t worker_id(std::int64_t random) const;
  bool operator==(const KeyRing&) const = default;

 private:
  std::vector<Key> learner_keys_;
  std::vector<WorkerKey> worker_keys_;
};

inline constexpr std::size_t kKeysPerRingMax = 4;
inline constexpr std::size_t kKeyFileBytesMax = 4096;

/// A worker's name begins as the id of its key does, so that no key speaks in the name of another
/// one's worker: 24 of 63 bits. The rest is its own.
constexpr bool may_sign_for(std::int64_t key_id, std::int64_t worker) {
  return protocol::key_part(key_id) == protocol::key_part(worker);
}
/// The first and the last name that a key may sign for which may sign for this one.
constexpr std::pair<std::int64_t, std::int64_t> names_of_one_key(std::int64_t worker) {
  constexpr std::int64_t kOwn = (std::int64_t{1} << protocol::kOwnNameBits) - 1;
  return {worker & ~kOwn, worker | kOwn};
}

/// What follows from a learner's key: the key of what it says to all, and of the worker of this id.
Key announcement_key(const Key& learner);
WorkerKey worker_key(const Key& learner, std::int64_t id);
/// The id of what an announcement key signs.
std::int64_t announcement_id(const Key& announcements);

/// Lines of a key file, without an end.
std::string line_of(const Key& learner);
std::string line_of(const WorkerKey& worker);

}  // namespace treeroll::transport
