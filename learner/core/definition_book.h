#pragma once

#include <map>
#include <string>

#include "common/base/content_hash.h"
#include "common/base/time.h"

namespace treeroll::learner {

/// The definitions (tasks or policies) that open roll-outs refer to, counted by their users, and
/// when each was last published.
class DefinitionBook {
 public:
  /// One user more of this content. @return its id
  ContentHash add(const std::string& content);
  /// One user less; the last one takes the definition out. Precondition: has this user.
  void release(const ContentHash& id);

  /// Null if no roll-out refers to it any more.
  const std::string* find(const ContentHash& id) const;

  /// True, and noted, if the definition may be published: it is in the book and was not published
  /// within the last kPublicationPause, however many workers ask.
  bool may_publish(const ContentHash& id, TimePoint now);

 private:
  struct Definition {
    std::string content;
    int num_users = 0;
    bool published = false;
    TimePoint published_at;
  };
  std::map<ContentHash, Definition> definitions_;
};

}  // namespace treeroll::learner
