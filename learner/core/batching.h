#pragma once

#include <cstddef>
#include <vector>

#include "common/protocol/messages.h"

namespace treeroll::learner {

/// As few messages as hold everything in order, none beyond `bytes_max` unless one roll-out alone
/// is larger, none past the counts of common/protocol/limits.h. No message if there is nothing.
/// Learner and sequence are left for the caller to fill in.
/// @param word_bytes  what a message takes more for each worker that it names (Bus::word_bytes)
std::vector<protocol::RolloutBatch> pack(
    std::vector<protocol::RolloutRequest> requests,
    const std::vector<protocol::Acknowledgement>& acknowledgements, std::size_t bytes_max,
    std::size_t word_bytes = 0);

}  // namespace treeroll::learner
