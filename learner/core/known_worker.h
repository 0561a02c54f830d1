#pragma once

#include <cstdint>
#include <string>

#include "common/protocol/messages.h"

namespace treeroll {

/// A worker whose results follow in the journal: on what they were computed.
struct KnownWorker {
  protocol::WorkerId worker_id = 0;
  std::string numeric_class;  ///< workers of one class give the same bits for the same roll-out
  std::string host;
  std::int32_t pid = 0;  ///< for people, as the host
  bool operator==(const KnownWorker&) const = default;
};

}  // namespace treeroll
