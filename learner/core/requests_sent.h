#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/protocol/messages.h"

namespace treeroll::learner {

/// The requests sent to one worker of which it has not said yet whether they have come, by the
/// batch that carried them. Its answers say which of the last 64 batches have come, so a request
/// that was lost is known as soon as an answer gets through.
class RequestsSent {
 public:
  /// Past kBatchBits batches the oldest goes: no word has a bit for it.
  void note(std::int64_t batch, protocol::RolloutKey key);

  struct Request {
    std::int64_t batch = 0;
    protocol::RolloutKey key;
  };
  struct Report {
    std::vector<Request> arrived;
    std::vector<Request> lost;
  };
  /// What its word says of them; what it has no bit for is left to leases and heartbeats. Each
  /// request is reported once.
  /// @param received  bit i is set if the batch last_batch - i has come
  Report take(std::int64_t last_batch, std::int64_t received);

 private:
  std::map<std::int64_t, std::vector<protocol::RolloutKey>> batches_;
};

}  // namespace treeroll::learner
