#pragma once

#include <cstddef>
#include <cstdint>

/// Every bound on what comes from or goes to the network, in one place. A message past one of them
/// is refused as a whole before anything of it is used.
namespace treeroll::protocol {

/// LCM's short messages: one datagram of at most 65507 bytes with header and channel name.
inline constexpr std::size_t kMessageBytesMax = 65000;
/// What a batch is filled to while it holds more than one roll-out, on one host (ttl 0).
inline constexpr std::size_t kBatchBytesLocalMax = 60000;
/// The same across hosts: one Ethernet frame, so that no fragment can be lost alone.
inline constexpr std::size_t kBatchBytesRemoteMax = 1400;

inline constexpr int kRolloutsPerBatchMax = 1024;
inline constexpr int kAcknowledgementsPerBatchMax = 1024;
inline constexpr int kResultsPerBatchMax = 1024;
inline constexpr int kHeldPerMessageMax = 4096;
inline constexpr int kLearnersPerStatusMax = 64;
inline constexpr int kEvaluatorsPerWorkerMax = 1024;
/// Running numbers (batches, results): far from where adding to them could overflow.
inline constexpr std::int64_t kRunningNumberMax = std::int64_t{1} << 62U;
/// No evaluation takes longer: 100 days.
inline constexpr std::int64_t kDurationNsMax = std::int64_t{100} * 24 * 3600 * 1'000'000'000;
inline constexpr int kDefinitionsPerRequestMax = 256;
inline constexpr int kThetaDimMax = 4096;
inline constexpr std::size_t kDefinitionBytesMax = 64000;
inline constexpr std::size_t kStringBytesMax = 1024;

}  // namespace treeroll::protocol
