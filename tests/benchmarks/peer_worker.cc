#include "tests/benchmarks/peer_master.h"

namespace treeroll::benchmarks {

void run_peer_worker(PeerLink& link, PeerRollouts& rollouts) {
  std::vector<PeerResult> results;
  for (;;) {
    const std::span<const PeerRequest> requests = link.receive();
    if (requests.empty()) return;
    results.clear();
    for (const PeerRequest& request : requests) results.push_back(rollouts.evaluate(request));
    link.send(results);
  }
}

LoneCount run_alone(PeerRollouts& rollouts, std::chrono::steady_clock::time_point from,
                    std::chrono::steady_clock::time_point to) {
  LoneCount count;
  for (;;) {
    (void)rollouts.evaluate(rollouts.request(count.in_all++));
    const auto now = std::chrono::steady_clock::now();
    if (now >= to) return count;
    if (now >= from) ++count.measured;
  }
}

}  // namespace treeroll::benchmarks
