#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "workers/core/worker_events.h"

namespace treeroll::worker {

enum class DefinitionState {
  kUnchecked,  ///< arrived, no evaluator has built it yet
  kChecking,   ///< an evaluator builds it now
  kAccepted,
  kRefused,  ///< its content is dropped, the reason kept
};

struct Definition {
  DefinitionState state = DefinitionState::kUnchecked;
  std::string content;  ///< empty once refused
  std::string text;     ///< accepted task: its description; refused: why
  DefinitionFacts facts;
  Duration rollout_time{};                ///< tasks: what one takes of late; 0 until one has ended
  int num_strikes = 0;                    ///< evaluators that ended while they built it
  std::set<protocol::LearnerId> to_tell;  ///< who sent it and waits for the report
  std::set<protocol::LearnerId> told;     ///< that it is accepted, who may hear otherwise yet
};

/// Definitions of one kind by id, bounded in number and bytes. When full, the least recently
/// used one that is not in use goes; if all are in use, the new one is not taken.
class DefinitionCache {
 public:
  DefinitionCache(std::size_t num_max, std::size_t bytes_max);

  /// Null if absent. Stays valid until the next insert.
  Definition* find(const ContentHash& id);
  const Definition* find(const ContentHash& id) const;
  /// Marks as used now. Precondition: present.
  void touch(const ContentHash& id);
  /// Null if there is no room. Precondition: absent.
  Definition* insert(const ContentHash& id, std::string content,
                     const std::set<ContentHash>& in_use);
  /// A reason longer than kReasonBytesMax is cut.
  void refuse(Definition& definition, std::string reason);
  /// As if they had never come.
  void erase_refused();

  std::size_t size() const { return entries_.size(); }
  std::size_t bytes() const { return bytes_; }
  /// Grows with each eviction: whoever mirrors the cache looks again when it changes.
  std::int64_t num_evicted() const { return num_evicted_; }

 private:
  struct Entry {
    Definition definition;
    std::int64_t used = 0;
  };

  bool evict_one(const std::set<ContentHash>& in_use);

  std::size_t num_max_;
  std::size_t bytes_max_;
  std::size_t bytes_ = 0;
  std::int64_t next_use_ = 0;
  std::int64_t num_evicted_ = 0;
  std::map<ContentHash, Entry> entries_;
  std::map<std::int64_t, ContentHash> by_use_;
};

}  // namespace treeroll::worker
