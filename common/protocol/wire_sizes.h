#pragma once

#include <cstddef>

#include "common/protocol/limits.h"

/// What messages and their parts take on the wire, for those who fill a batch up to a size. Each is
/// held to what lcm-gen writes by tests/transport/wire_sizes_test.cc.
namespace treeroll::protocol {

/// LCM's magic and sequence number; the name of the channel with its NUL follows.
inline constexpr std::size_t kFrameHeaderBytes = 4 + 4;
/// The same with the longest name.
inline constexpr std::size_t kFrameBytesMax = kFrameHeaderBytes + 63 + 1;

inline constexpr std::size_t kFingerprintBytes = 8;  ///< names the layout; begins a message
inline constexpr std::size_t kIdBytes = 8;           ///< of a worker or a learner
inline constexpr std::size_t kIndexBytes = 8;        ///< of a batch or a result
inline constexpr std::size_t kCountBytes = 4;        ///< before a list or a string
inline constexpr std::size_t kContentHashBytes = 16;
inline constexpr std::size_t kMacBytes = 16;
/// Key, index and authentication code: end a message.
inline constexpr std::size_t kSignatureBytes = 8 + kIndexBytes + kMacBytes;
/// Of a signed batch, for each worker that it names.
inline constexpr std::size_t kWordMacBytes = kMacBytes;
inline constexpr std::size_t kRolloutKeyBytes = 8;  ///< run, number

/// Worker, key, attempt, content, task, policy, task seed, counts of theta and its name; and theta.
constexpr std::size_t rollout_request_bytes(std::size_t theta_dim) {
  return kIdBytes + kRolloutKeyBytes + 4 + 8 + 2 * kContentHashBytes + 8 + 2 * kCountBytes +
         8 * theta_dim;
}
/// The same where theta comes in pieces, under its name.
inline constexpr std::size_t kRequestByNameBytes = rollout_request_bytes(0) + kContentHashBytes;
/// Key, attempt, content, reward, status, length and NUL of the reason, duration; and the reason.
constexpr std::size_t rollout_result_bytes(std::size_t reason_bytes) {
  return kRolloutKeyBytes + 4 + 8 + 8 + 1 + kCountBytes + 1 + 8 + reason_bytes;
}
/// Worker, two results.
inline constexpr std::size_t kAcknowledgementBytes = kIdBytes + 2 * kIndexBytes;

// Messages with empty lists and strings.

/// Learner, sequence, counts of roll-outs, acknowledgements and their authentication codes.
inline constexpr std::size_t kRolloutBatchBytes =
    kFingerprintBytes + kIdBytes + kIndexBytes + 3 * kCountBytes + kSignatureBytes;
/// Worker, learner, last batch, batches received, free slots, oldest and first result, count of
/// results.
inline constexpr std::size_t kRewardBatchBytes = kFingerprintBytes + 2 * kIdBytes +
                                                 2 * kIndexBytes + 4 + 2 * kIndexBytes +
                                                 kCountBytes + kSignatureBytes;
/// Worker, three names with their NULs, pid, evaluators, free slots, receive buffer, draining, five
/// counters, count of learners.
inline constexpr std::size_t kWorkerStatusBytes = kFingerprintBytes + kIdBytes +
                                                  3 * (kCountBytes + 1) + 4 * 4 + 1 + 5 * 8 +
                                                  kCountBytes + kSignatureBytes;
/// Of a status: learner, last batch, last result, count of keys, from where to where.
inline constexpr std::size_t kHeldRolloutsBytes =
    kIdBytes + 2 * kIndexBytes + kCountBytes + 2 * kRolloutKeyBytes;
/// Worker, learner, count of definitions.
inline constexpr std::size_t kDefinitionRequestBytes =
    kFingerprintBytes + 2 * kIdBytes + kCountBytes + kSignatureBytes;
/// Kind, hash, count of pieces; and their numbers.
constexpr std::size_t wanted_definition_bytes(std::size_t num_pieces) {
  return 1 + kContentHashBytes + kCountBytes + 4 * num_pieces;
}
/// Learner, kind, hash, size of the whole, number, count of bytes.
inline constexpr std::size_t kDefinitionPieceBytes =
    kFingerprintBytes + kIdBytes + 1 + kContentHashBytes + 4 + 4 + kCountBytes + kSignatureBytes;

static_assert(kFrameBytesMax + kDefinitionPieceBytes + kPieceBytes <= kBatchBytesRemoteMax,
              "a piece fits a frame");

}  // namespace treeroll::protocol
