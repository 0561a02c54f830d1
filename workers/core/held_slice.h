#pragma once

#include <cstddef>
#include <vector>

#include "common/protocol/messages.h"

namespace treeroll::worker {

/// Of what is held, as much as a message has room for: all from `first` to `last`.
struct HeldSlice {
  std::vector<protocol::RolloutKey> keys;
  protocol::RolloutKey first = protocol::kFirstKey;
  protocol::RolloutKey last = protocol::kLastKey;

  /// Where the next slice begins.
  protocol::RolloutKey next() const;
};

/// @param held     ascending
/// @param from     where it begins
/// @param num_max  keys, at least 1
HeldSlice slice_of(const std::vector<protocol::RolloutKey>& held, protocol::RolloutKey from,
                   std::size_t num_max);

}  // namespace treeroll::worker
