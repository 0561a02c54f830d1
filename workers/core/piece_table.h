#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/protocol/limits.h"
#include "common/protocol/messages.h"

namespace treeroll::worker {

/// A learner's definition: what others send under the same name does not mix with it.
using PartialName = std::pair<protocol::LearnerId, protocol::DefinitionName>;

/// Definitions that have come in part. Bounded in number and bytes, whatever is sent: when full,
/// those that were touched longest ago and that no roll-out waits for go; if all are waited for,
/// those of the highest names, so that the lowest are finished first.
class PieceTable {
 public:
  PieceTable(std::size_t num_max, std::size_t bytes_max);

  struct Added {
    std::optional<std::string> whole;  ///< its last piece has come, and it is what its id names
    std::string refusal;               ///< not empty: why nothing is kept of what was sent
  };
  /// A piece of another total size than those before begins anew. So a wrong one delays a
  /// definition, but cannot keep it out.
  /// @param waited_for  asked for what must stay only when the table is full
  Added add(const protocol::DefinitionPiece& piece,
            const std::function<std::set<PartialName>()>& waited_for);

  /// Numbers of the pieces that are not here yet; none if nothing is here of it.
  std::vector<std::int32_t> missing(const PartialName& name) const;

  std::size_t size() const { return partials_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Partial {
    std::int32_t num_bytes = 0;  ///< of the whole
    std::map<std::int32_t, std::string> pieces;
    std::size_t bytes = 0;  ///< of the pieces here
    std::int64_t used = 0;
  };
  using Place = std::map<PartialName, Partial>::iterator;

  /// For one piece more, of a definition of which nothing is here yet or something is.
  bool is_full(bool begins) const {
    return (begins && partials_.size() >= num_max_) || bytes_ + protocol::kPieceBytes > bytes_max_;
  }
  void make_room(const std::set<PartialName>& waited_for, const PartialName& newest);
  void drop(Place place);

  std::size_t num_max_;
  std::size_t bytes_max_;
  std::size_t bytes_ = 0;
  std::int64_t next_use_ = 0;
  std::map<PartialName, Partial> partials_;
  std::map<std::int64_t, PartialName> by_use_;
};

}  // namespace treeroll::worker
