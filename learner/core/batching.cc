#include "learner/core/batching.h"

#include <utility>

#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

// LCM frame (8), channel name, fingerprint (8), learner (8), sequence (8), two counts (8), MAC
// (16).
constexpr std::size_t kBatchOverheadBytes = 8 + 64 + 8 + 8 + 8 + 8 + 16;
// Worker (8), run, number, attempt (12), content (8), task and policy (32), seed (8), count (4).
constexpr std::size_t kRequestOverheadBytes = 8 + 12 + 8 + 32 + 8 + 4;
constexpr std::size_t kAcknowledgementBytes = 8 + 8;

}  // namespace

std::size_t encoded_bytes(const protocol::RolloutRequest& request) {
  return kRequestOverheadBytes + request.theta.size() * sizeof(double);
}

std::vector<protocol::RolloutBatch> pack(
    std::vector<protocol::RolloutRequest> requests,
    const std::vector<protocol::Acknowledgement>& acknowledgements, std::size_t bytes_max) {
  std::vector<protocol::RolloutBatch> batches;
  std::size_t bytes = 0;
  const auto make_room = [&](std::size_t more, auto list, int count_max) {
    const bool fits = !batches.empty() && bytes + more <= bytes_max &&
                      (batches.back().*list).size() < static_cast<std::size_t>(count_max);
    if (!fits) {
      batches.emplace_back();
      bytes = kBatchOverheadBytes;
    }
    bytes += more;
  };
  for (const protocol::Acknowledgement& acknowledgement : acknowledgements) {
    make_room(kAcknowledgementBytes, &protocol::RolloutBatch::acknowledgements,
              protocol::kAcknowledgementsPerBatchMax);
    batches.back().acknowledgements.push_back(acknowledgement);
  }
  for (protocol::RolloutRequest& request : requests) {
    make_room(encoded_bytes(request), &protocol::RolloutBatch::rollouts,
              protocol::kRolloutsPerBatchMax);
    batches.back().rollouts.push_back(std::move(request));
  }
  return batches;
}

}  // namespace treeroll::learner
