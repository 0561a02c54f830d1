#include "learner/core/requests_sent.h"

#include <iterator>

#include "common/protocol/limits.h"

namespace treeroll::learner {

void RequestsSent::note(std::int64_t batch, protocol::RolloutKey key) {
  batches_[batch].push_back(key);
  if (std::ssize(batches_) > protocol::kBatchBits) batches_.erase(batches_.begin());
}

RequestsSent::Report RequestsSent::take(std::int64_t last_batch, std::int64_t received) {
  Report report;
  const auto bits = static_cast<std::uint64_t>(received);
  while (!batches_.empty() && batches_.begin()->first <= last_batch) {
    const auto& [batch, keys] = *batches_.begin();
    const std::int64_t age = last_batch - batch;
    if (age < protocol::kBatchBits) {
      const bool has_come = (bits >> static_cast<unsigned>(age) & 1U) != 0;
      std::vector<Request>& requests = has_come ? report.arrived : report.lost;
      for (const protocol::RolloutKey key : keys) requests.push_back({batch, key});
    }
    batches_.erase(batches_.begin());
  }
  return report;
}

}  // namespace treeroll::learner
