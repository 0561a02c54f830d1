#include "learner/core/batching.h"

#include <set>
#include <utility>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"

namespace treeroll::learner {
std::vector<protocol::RolloutBatch> pack(
    std::vector<protocol::RolloutRequest> requests,
    const std::vector<protocol::Acknowledgement>& acknowledgements, std::size_t bytes_max,
    std::size_t word_bytes) {
  std::vector<protocol::RolloutBatch> batches;
  std::size_t bytes = 0;
  std::set<protocol::WorkerId> named;  // in the last one, where that costs something
  const auto make_room = [&](protocol::WorkerId worker, std::size_t more, auto list,
                             int count_max) {
    if (!named.contains(worker)) more += word_bytes;
    const bool fits = !batches.empty() && bytes + more <= bytes_max &&
                      (batches.back().*list).size() < static_cast<std::size_t>(count_max);
    if (!fits) {
      batches.emplace_back();
      bytes = protocol::kFrameBytesMax + protocol::kRolloutBatchBytes;
      named.clear();
    }
    bytes += more;
    if (word_bytes > 0) named.insert(worker);
  };
  for (const protocol::Acknowledgement& acknowledgement : acknowledgements) {
    make_room(acknowledgement.worker_id, protocol::kAcknowledgementBytes,
              &protocol::RolloutBatch::acknowledgements, protocol::kAcknowledgementsPerBatchMax);
    batches.back().acknowledgements.push_back(acknowledgement);
  }
  for (protocol::RolloutRequest& request : requests) {
    make_room(request.worker_id,
              request.theta_id ? protocol::kRequestByNameBytes
                               : protocol::rollout_request_bytes(request.theta.size()),
              &protocol::RolloutBatch::rollouts, protocol::kRolloutsPerBatchMax);
    batches.back().rollouts.push_back(std::move(request));
  }
  return batches;
}

}  // namespace treeroll::learner
