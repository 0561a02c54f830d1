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

std::int64_t run_alone(PeerRollouts& rollouts, std::chrono::steady_clock::time_point from,
                       std::chrono::steady_clock::time_point to) {
  std::int64_t number = 0;
  std::int64_t counted = 0;
  for (;;) {
    (void)rollouts.evaluate(rollouts.request(number++));
    const auto now = std::chrono::steady_clock::now();
    if (now >= to) return counted;
    if (now >= from) ++counted;
  }
}

}  // namespace treeroll::benchmarks
