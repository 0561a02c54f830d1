#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "workers/tasks/task.h"

namespace treeroll::benchmarks {

/// Most numbers of a theta that a peer's packets hold.
inline constexpr int kPeerThetaMax = 12;

/// What is asked of a peer's worker, as it lies in memory: both are of one host.
struct PeerRequest {
  std::int64_t number = 0;
  double theta[kPeerThetaMax] = {};
};
struct PeerResult {
  std::int64_t number = 0;
  double reward = 0;
};
inline constexpr int kPeerBatchMax = 64;

/// The roll-outs of the comparison, the same for all: the policy with theta, then the task.
class PeerRollouts {
 public:
  /// @param study      cluster.toml
  /// @param overrides  as --set of the learner takes them
  /// Throws ConfigError if its theta is past kPeerThetaMax.
  PeerRollouts(const std::string& study, const std::vector<std::string>& overrides);

  /// Roll-out `number`: each has another theta.
  PeerRequest request(std::int64_t number) const;
  PeerResult evaluate(const PeerRequest& request);

 private:
  PolicyPtr start_;
  std::unique_ptr<Task> task_;
  Eigen::VectorXd theta_;
};

}  // namespace treeroll::benchmarks
