#pragma once

#include <cstddef>

/// What messages and their parts take on the wire, for those who fill a batch up to a size. Each is
/// held to what lcm-gen writes by tests/transport/wire_sizes_test.cc.
namespace treeroll::protocol {

/// LCM's magic and sequence number, and the longest name of a channel with its NUL.
inline constexpr std::size_t kFrameBytesMax = 4 + 4 + 63 + 1;

inline constexpr std::size_t kFingerprintBytes = 8;  ///< names the layout; begins a message
inline constexpr std::size_t kIdBytes = 8;           ///< of a worker or a learner
inline constexpr std::size_t kIndexBytes = 8;        ///< of a batch or a result
inline constexpr std::size_t kCountBytes = 4;        ///< before a list or a string
inline constexpr std::size_t kContentHashBytes = 16;
inline constexpr std::size_t kMacBytes = 16;        ///< ends a message
inline constexpr std::size_t kRolloutKeyBytes = 8;  ///< run, number

/// Worker, key, attempt, content, task, policy, task seed, theta's count; and theta.
constexpr std::size_t rollout_request_bytes(std::size_t theta_dim) {
  return kIdBytes + kRolloutKeyBytes + 4 + 8 + 2 * kContentHashBytes + 8 + kCountBytes +
         8 * theta_dim;
}
/// Key, attempt, content, reward, status, length and NUL of the reason, duration; and the reason.
constexpr std::size_t rollout_result_bytes(std::size_t reason_bytes) {
  return kRolloutKeyBytes + 4 + 8 + 8 + 1 + kCountBytes + 1 + 8 + reason_bytes;
}
/// Worker, result.
inline constexpr std::size_t kAcknowledgementBytes = kIdBytes + kIndexBytes;

// Messages with empty lists and strings.

/// Learner, sequence, counts of roll-outs and acknowledgements.
inline constexpr std::size_t kRolloutBatchBytes =
    kFingerprintBytes + kIdBytes + kIndexBytes + 2 * kCountBytes + kMacBytes;
/// Worker, learner, last batch, free slots, first and last result, counts of results and held ones.
inline constexpr std::size_t kRewardBatchBytes = kFingerprintBytes + 2 * kIdBytes + kIndexBytes +
                                                 4 + 2 * kIndexBytes + 2 * kCountBytes + kMacBytes;
/// Worker, learner, counts of tasks and policies.
inline constexpr std::size_t kDefinitionRequestBytes =
    kFingerprintBytes + 2 * kIdBytes + 2 * kCountBytes + kMacBytes;
/// Of a task or a policy: learner, hash, length and NUL of the content.
inline constexpr std::size_t kDefinitionBytes =
    kFingerprintBytes + kIdBytes + kContentHashBytes + kCountBytes + 1 + kMacBytes;

}  // namespace treeroll::protocol
