#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/messages.h"

namespace treeroll::learner {

/// The definitions that open roll-outs refer to, counted by their users, and which of their pieces
/// are to be sent. Pieces go out in bursts that receivers have room for. One is not sent again
/// within kPublicationPause, however many workers ask.
class DefinitionBook {
 public:
  /// One user more of this content. @return its id
  ContentHash add(protocol::DefinitionKind kind, const std::string& content);
  /// One user more of one that is in the book. Precondition: it is.
  void keep(const protocol::DefinitionName& name);
  /// One user less; the last one takes the definition out. Precondition: has this user.
  void release(const protocol::DefinitionName& name);

  /// Null if no roll-out refers to it any more.
  const std::string* find(const protocol::DefinitionName& name) const;

  /// All of it is to be sent, or what of it is wanted. Nothing happens if it is not in the book; a
  /// piece it does not have is ignored.
  void publish(const protocol::DefinitionName& name, TimePoint now);
  void publish_wanted(const protocol::WantedDefinition& wanted, TimePoint now);

  /// What is to be sent now, definitions in turn; each piece counts as sent.
  std::vector<protocol::DefinitionPiece> take_due(protocol::LearnerId learner, TimePoint now);
  /// When take_due() has more; nothing if no piece is to be sent.
  std::optional<TimePoint> next_burst() const;

 private:
  struct Definition {
    std::string content;
    int num_users = 0;
    std::set<int> due;               ///< pieces
    std::vector<TimePoint> sent_at;  ///< of each piece
  };

  void add_due(const protocol::DefinitionName& name, Definition& definition, int index,
               TimePoint now);

  std::map<protocol::DefinitionName, Definition> definitions_;
  /// Those with pieces that are due, each once.
  std::deque<protocol::DefinitionName> row_;
  TimePoint burst_at_{};   ///< the last one
  int room_in_burst_ = 1;  ///< more of it may be sent
};

}  // namespace treeroll::learner
