#include "learner/core/definition_book.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/protocol/pieces.h"
#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

/// So many fit the receive buffer that the kernel gives whoever asks for no larger one, twice.
constexpr int kPiecesPerBurst = 32;
/// With the above: 16 MB a second.
constexpr Duration kBurstPause = std::chrono::milliseconds(2);

}  // namespace

using protocol::DefinitionName;

ContentHash DefinitionBook::add(protocol::DefinitionKind kind, const std::string& content) {
  const ContentHash id = content_hash(content);
  Definition& definition = definitions_[{kind, id}];
  if (definition.num_users++ == 0) {
    definition.content = content;
    definition.sent_at.assign(static_cast<std::size_t>(protocol::num_pieces(content.size())),
                              TimePoint::min());
  }
  return id;
}

void DefinitionBook::keep(const DefinitionName& name) {
  const auto found = definitions_.find(name);
  CHECK(found != definitions_.end(), "only a definition that has users can be kept");
  ++found->second.num_users;
}

void DefinitionBook::release(const DefinitionName& name) {
  const auto found = definitions_.find(name);
  CHECK(found != definitions_.end(), "a definition was released more often than added");
  if (--found->second.num_users > 0) return;
  if (!found->second.due.empty()) std::erase(row_, name);
  definitions_.erase(found);
}

const std::string* DefinitionBook::find(const DefinitionName& name) const {
  const auto found = definitions_.find(name);
  return found == definitions_.end() ? nullptr : &found->second.content;
}

void DefinitionBook::publish(const DefinitionName& name, TimePoint now) {
  publish_wanted({.name = name, .pieces = {}}, now);
}

void DefinitionBook::publish_wanted(const protocol::WantedDefinition& wanted, TimePoint now) {
  const auto found = definitions_.find(wanted.name);
  if (found == definitions_.end()) return;
  Definition& definition = found->second;
  const int num_pieces = static_cast<int>(definition.sent_at.size());
  if (wanted.pieces.empty()) {
    for (int index = 0; index < num_pieces; ++index) {
      add_due(wanted.name, definition, index, now);
    }
  }
  for (const std::int32_t index : wanted.pieces) {
    if (index >= 0 && index < num_pieces) add_due(wanted.name, definition, index, now);
  }
}

void DefinitionBook::add_due(const DefinitionName& name, Definition& definition, int index,
                             TimePoint now) {
  const TimePoint sent_at = definition.sent_at[static_cast<std::size_t>(index)];
  if (sent_at != TimePoint::min() && now < sent_at + protocol::kPublicationPause) return;
  if (definition.due.empty()) row_.push_back(name);
  definition.due.insert(index);
}

std::vector<protocol::DefinitionPiece> DefinitionBook::take_due(protocol::LearnerId learner,
                                                                TimePoint now) {
  std::vector<protocol::DefinitionPiece> pieces;
  if (row_.empty()) return pieces;
  if (now >= burst_at_ + kBurstPause) {
    burst_at_ = now;
    room_in_burst_ = kPiecesPerBurst;
  }
  while (!row_.empty() && room_in_burst_ > 0) {
    const DefinitionName name = row_.front();
    Definition& definition = definitions_.at(name);
    row_.pop_front();
    for (; !definition.due.empty() && room_in_burst_ > 0; --room_in_burst_) {
      const int index = *definition.due.begin();
      definition.due.erase(definition.due.begin());
      definition.sent_at[static_cast<std::size_t>(index)] = now;
      pieces.push_back(protocol::definition_piece(learner, name, definition.content, index));
    }
    if (!definition.due.empty()) row_.push_back(name);
  }
  return pieces;
}

std::optional<TimePoint> DefinitionBook::next_burst() const {
  if (row_.empty()) return std::nullopt;
  return room_in_burst_ > 0 ? burst_at_ : burst_at_ + kBurstPause;
}

}  // namespace treeroll::learner
