#include "workers/core/definition_cache.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/cut_text.h"
#include "common/protocol/limits.h"

namespace treeroll::worker {

DefinitionCache::DefinitionCache(std::size_t num_max, std::size_t bytes_max)
    : num_max_(num_max), bytes_max_(bytes_max) {}

Definition* DefinitionCache::find(const ContentHash& id) {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second.definition;
}

const Definition* DefinitionCache::find(const ContentHash& id) const {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second.definition;
}

void DefinitionCache::touch(const ContentHash& id) {
  Entry& entry = entries_.at(id);
  by_use_.erase(entry.used);
  entry.used = next_use_++;
  by_use_.emplace(entry.used, id);
}

Definition* DefinitionCache::insert(const ContentHash& id, std::string content,
                                    const std::set<ContentHash>& in_use) {
  CHECK(!entries_.contains(id), "a definition inserted twice");
  if (content.size() > bytes_max_) return nullptr;
  while (entries_.size() >= num_max_ || bytes_ + content.size() > bytes_max_) {
    if (!evict_one(in_use)) return nullptr;
  }
  bytes_ += content.size();
  Entry& entry = entries_[id];
  entry.definition.content = std::move(content);
  entry.used = next_use_++;
  by_use_.emplace(entry.used, id);
  return &entry.definition;
}

void DefinitionCache::refuse(Definition& definition, std::string reason) {
  bytes_ -= definition.content.size();
  definition.content.clear();
  definition.state = DefinitionState::kRefused;
  definition.text = cut_text(std::move(reason), protocol::kReasonBytesMax);
}

void DefinitionCache::erase_refused() {
  for (auto it = entries_.begin(); it != entries_.end();) {
    const bool is_refused = it->second.definition.state == DefinitionState::kRefused;
    if (is_refused) by_use_.erase(it->second.used);
    it = is_refused ? entries_.erase(it) : std::next(it);
  }
}

bool DefinitionCache::evict_one(const std::set<ContentHash>& in_use) {
  const auto oldest = std::find_if(by_use_.begin(), by_use_.end(), [&](const auto& use) {
    const bool checking = entries_.at(use.second).definition.state == DefinitionState::kChecking;
    return !checking && !in_use.contains(use.second);
  });
  if (oldest == by_use_.end()) return false;
  bytes_ -= entries_.at(oldest->second).definition.content.size();
  entries_.erase(oldest->second);
  by_use_.erase(oldest);
  ++num_evicted_;
  return true;
}

}  // namespace treeroll::worker
