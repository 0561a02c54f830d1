#include "learner/core/definition_book.h"

#include "common/base/check.h"
#include "common/protocol/timings.h"

namespace treeroll::learner {

ContentHash DefinitionBook::add(const std::string& content) {
  const ContentHash id = content_hash(content);
  Definition& definition = definitions_[id];
  if (definition.num_users++ == 0) definition.content = content;
  return id;
}

void DefinitionBook::release(const ContentHash& id) {
  const auto found = definitions_.find(id);
  CHECK(found != definitions_.end(), "a definition was released more often than added");
  if (--found->second.num_users == 0) definitions_.erase(found);
}

const std::string* DefinitionBook::find(const ContentHash& id) const {
  const auto found = definitions_.find(id);
  return found == definitions_.end() ? nullptr : &found->second.content;
}

bool DefinitionBook::may_publish(const ContentHash& id, TimePoint now) {
  const auto found = definitions_.find(id);
  if (found == definitions_.end()) return false;
  Definition& definition = found->second;
  if (definition.published && now < definition.published_at + protocol::kPublicationPause)
    return false;
  definition.published = true;
  definition.published_at = now;
  return true;
}

}  // namespace treeroll::learner
