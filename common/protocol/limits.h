#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/outcome.h"

/// Every bound of the service in one place: README.md has, for each, its reason, what happens past
/// it and the test that shows it.
namespace treeroll::protocol {

// Messages: what a sender may build and what a receiver takes.

/// LCM's short messages: one datagram of at most 65507 bytes with header and channel name.
inline constexpr std::size_t kMessageBytesMax = 65000;
/// What a batch is filled to on one host (ttl 0).
inline constexpr std::size_t kBatchBytesLocalMax = 60000;
/// The same across hosts, and there the most of any message with LCM's header: one Ethernet frame,
/// with room for a tunnel's header. No path loses a part of a message, nor refuses fragments.
inline constexpr std::size_t kBatchBytesRemoteMax = 1400;

inline constexpr int kRolloutsPerBatchMax = 1024;
inline constexpr int kAcknowledgementsPerBatchMax = 1024;
/// Workers that one batch of roll-outs and acknowledgements names.
inline constexpr int kNamedPerBatchMax = kRolloutsPerBatchMax + kAcknowledgementsPerBatchMax;
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
/// Of a task's or a policy's text: so many full pieces.
inline constexpr std::size_t kDefinitionBytesMax = std::size_t{1} << 20U;
/// What a definition is cut into; all but the last piece have so many bytes.
inline constexpr std::size_t kPieceBytes = 1024;
inline constexpr int kPiecesMax = static_cast<int>(kDefinitionBytesMax / kPieceBytes);
inline constexpr std::size_t kStringBytesMax = 1024;
/// Of hosts, versions, studies, conditions.
inline constexpr std::size_t kNameBytesMax = 128;
/// Why a worker refuses a definition, or a roll-out has failed; longer texts are cut.
inline constexpr std::size_t kReasonBytesMax = kOutcomeReasonBytesMax;
/// Read from the multicast socket before timers and evaluators get their turn.
inline constexpr int kDatagramsPerTurnMax = 256;

// A study: what is refused when it is loaded.

inline constexpr std::size_t kConditionsMax = 1000;
/// Conditions times repetitions.
inline constexpr std::int64_t kRunsMax = 100'000;
inline constexpr std::int64_t kRolloutsMax = 100'000'000;  ///< of one run
/// What is kept of each until the end is 16 bytes.
inline constexpr std::int64_t kRolloutsTotalMax = 100'000'000;
inline constexpr std::int64_t kInFlightMax = 100'000;  ///< of one run
/// Drawn and not answered, of all runs together: what the ledger holds.
inline constexpr std::int64_t kInFlightTotalMax = 1'000'000;

// The learner.

/// Heard within the last seconds; and so many records of those that have left.
inline constexpr std::size_t kWorkersMax = 4096;
/// Of these, that have one key: names of one begin alike.
inline constexpr int kWorkersOfOneKeyMax = 1024;
/// A worker names all it holds in one message.
inline constexpr int kLeasesPerWorkerMax = kHeldPerMessageMax;
inline constexpr std::size_t kRefusalsPerWorkerMax = 256;
/// Workers that have been asked one question and may still answer it.
inline constexpr std::size_t kAskedMax = 64;
/// Different descriptions of one task that workers give.
inline constexpr std::size_t kDescriptionsMax = 16;
/// A worker that has answered nothing counts for so many evaluators at most.
inline constexpr int kEvaluatorsUnshownMax = 16;
/// Of a worker's results, stretches that have been read past missing ones.
inline constexpr std::size_t kStretchesReadMax = 256;
/// Of the learner's last batches a worker says whether they have come: a bit each. Requests in
/// older ones are not waited for.
inline constexpr std::int64_t kBatchBits = 64;
inline constexpr std::size_t kNumericClassesMax = 1024;
/// Roll-outs that wait for the answer of one more worker, and the workers that one is asked of.
inline constexpr std::size_t kRechecksOpenMax = 256;
inline constexpr std::size_t kOpinionsMax = 5;
/// Of the name of a numeric class, and of a host's in the journal; longer ones are cut.
inline constexpr std::size_t kNumericClassBytesMax = 128;
inline constexpr std::size_t kHostNameBytesMax = 64;
/// The journal's lag: results written and not yet on stable storage, at most 358 bytes each.
inline constexpr std::int64_t kUnsyncedResultsMax = 65'536;

// A worker.

inline constexpr int kHeldPerEvaluatorMax = 64;
inline constexpr std::size_t kLearnersPerWorkerMax = kLearnersPerStatusMax;
inline constexpr std::size_t kAnswersMax = 8192;
inline constexpr std::size_t kTasksMax = 64;
inline constexpr std::size_t kPoliciesMax = 1024;
/// Of tasks, and again of policies.
inline constexpr std::size_t kDefinitionCacheBytesMax = 32U << 20U;
/// Of definitions that have come in part: how many, and the bytes there of them.
inline constexpr std::size_t kPartialDefinitionsMax = 1024;
inline constexpr std::size_t kPartialBytesMax = 16U << 20U;
/// Learners whose last result index outlives them.
inline constexpr std::size_t kForgottenLearnersMax = 4096;
/// Reports of definitions in answer to the messages of one turn.
inline constexpr std::size_t kReportsPerTurnMax = 1024;

}  // namespace treeroll::protocol
