#include "workers/core/piece_table.h"

#include <fmt/format.h>

#include <iterator>

#include "common/protocol/pieces.h"

namespace treeroll::worker {

PieceTable::PieceTable(std::size_t num_max, std::size_t bytes_max)
    : num_max_(num_max), bytes_max_(bytes_max) {}

PieceTable::Added PieceTable::add(const protocol::DefinitionPiece& piece,
                                  const std::function<std::set<PartialName>()>& waited_for) {
  if (!protocol::is_sound(piece)) {
    return {{},
            fmt::format("piece {} with {} bytes does not fit a whole of {} bytes", piece.index,
                        piece.bytes.size(), piece.num_bytes)};
  }
  const PartialName name{piece.learner_id, piece.name};
  Place place = partials_.find(name);
  if (place != partials_.end() && place->second.num_bytes != piece.num_bytes) {
    drop(place);
    place = partials_.end();
  }
  if (place != partials_.end() && place->second.pieces.contains(piece.index)) return {};
  const bool begins = place == partials_.end();
  if (is_full(begins)) {
    make_room(waited_for(), name);
    // All that is left is waited for. The lowest names go on, or none would ever be whole.
    while (is_full(begins)) {
      if (partials_.empty()) return {};
      const Place last = std::prev(partials_.end());
      if (last->first <= name) return {};  // asked for again while it is waited for
      drop(last);
    }
  }
  if (begins) {
    place = partials_.emplace(name, Partial{.num_bytes = piece.num_bytes, .pieces = {}}).first;
  } else {
    by_use_.erase(place->second.used);
  }
  Partial& partial = place->second;
  partial.used = next_use_++;
  by_use_.emplace(partial.used, name);
  partial.pieces.emplace(piece.index, piece.bytes);
  partial.bytes += piece.bytes.size();
  bytes_ += piece.bytes.size();
  if (partial.bytes < static_cast<std::size_t>(partial.num_bytes)) return {};

  std::string whole;
  whole.reserve(partial.bytes);
  for (const auto& [index, bytes] : partial.pieces) whole += bytes;
  drop(place);
  if (content_hash(whole) != piece.name.id) return {{}, "is not what its id names"};
  return {std::move(whole), {}};
}

std::vector<std::int32_t> PieceTable::missing(const PartialName& name) const {
  std::vector<std::int32_t> missing;
  const auto place = partials_.find(name);
  if (place == partials_.end()) return missing;
  const Partial& partial = place->second;
  const int num = protocol::num_pieces(static_cast<std::size_t>(partial.num_bytes));
  for (int index = 0; index < num; ++index) {
    if (!partial.pieces.contains(index)) missing.push_back(index);
  }
  return missing;
}

/// An eighth at a time, so that a flood does not make each of its pieces ask what is waited for.
void PieceTable::make_room(const std::set<PartialName>& waited_for, const PartialName& newest) {
  const std::size_t num = num_max_ - num_max_ / 8;
  const std::size_t bytes = bytes_max_ - bytes_max_ / 8;
  for (auto use = by_use_.begin(); use != by_use_.end();) {
    if (partials_.size() < num && bytes_ < bytes) return;
    const PartialName name = (use++)->second;
    if (name != newest && !waited_for.contains(name)) drop(partials_.find(name));
  }
}

void PieceTable::drop(Place place) {
  bytes_ -= place->second.bytes;
  by_use_.erase(place->second.used);
  partials_.erase(place);
}

}  // namespace treeroll::worker
