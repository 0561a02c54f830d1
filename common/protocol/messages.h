#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/outcome.h"

/// The messages of the service as values; what each field means on the wire stands in lcmtypes/.
/// From learner to workers (L>W), from worker to learner (W>L), and for people who watch (L>*).
namespace treeroll::protocol {

/// Names of processes and incarnations: random 63-bit numbers, drawn at start.
using WorkerId = std::int64_t;
using LearnerId = std::int64_t;
/// Where there are keys, a worker's name begins as the id of its key does: these bits are its own.
inline constexpr unsigned kOwnNameBits = 39;
/// What the names of one key begin with. Without keys names begin at random.
constexpr std::int64_t key_part(std::int64_t name) { return name >> kOwnNameBits; }

/// One roll-out of one run. Roll-outs of the budget are numbered 0 .. N-1. Outside of it are the
/// evaluations of the start policy, -2, and of the final mean policy, -1, -3, -4, ...
struct RolloutKey {
  std::int32_t run = 0;
  std::int32_t number = 0;
  auto operator<=>(const RolloutKey&) const = default;
};
/// Before and after all others.
inline constexpr RolloutKey kFirstKey{0, std::numeric_limits<std::int32_t>::min()};
inline constexpr RolloutKey kLastKey{std::numeric_limits<std::int32_t>::max(),
                                     std::numeric_limits<std::int32_t>::max()};

/// What travels apart from the roll-outs that refer to it, under the hash of its content.
enum class DefinitionKind : std::int8_t {
  kTask,    ///< JSON: {"name": ..., "settings": {...}}
  kPolicy,  ///< JSON of common/policy/policy.h
  kTheta,   ///< numbers of a roll-out that is larger than a frame (pieces.h)
};
inline constexpr int kNumDefinitionKinds = 3;

struct DefinitionName {
  DefinitionKind kind = DefinitionKind::kTask;
  ContentHash id;
  auto operator<=>(const DefinitionName&) const = default;
};

struct RolloutRequest {
  WorkerId worker_id = 0;  ///< who is asked
  RolloutKey key;
  std::int32_t attempt = 0;  ///< 0, then one more for each re-issue
  std::int64_t content = 0;  ///< short hash of task, policy, theta and seed; echoed
  ContentHash task_id;
  ContentHash policy_id;
  std::int64_t task_seed = 0;  ///< for tasks that are not deterministic
  std::vector<double> theta;   ///< perturbed parameters of the policy's layer
  /// If theta is not here: its name; it comes in pieces.
  std::optional<ContentHash> theta_id{};
  bool operator==(const RolloutRequest&) const = default;
};

/// All results of this worker up to and including `seen_index` have been read: it need not repeat
/// them. All up to `result_index` are settled for good: it need not keep them.
struct Acknowledgement {
  WorkerId worker_id = 0;
  std::int64_t seen_index = 0;
  std::int64_t result_index = 0;
  bool operator==(const Acknowledgement&) const = default;
};

/// L>W: roll-outs of any number of runs for any number of workers.
struct RolloutBatch {
  LearnerId learner_id = 0;
  std::int64_t sequence = 0;  ///< 1, 2, ... for each batch of this learner
  std::vector<RolloutRequest> rollouts;
  std::vector<Acknowledgement> acknowledgements;
  bool operator==(const RolloutBatch&) const = default;
};

struct RolloutResult {
  RolloutKey key;
  std::int32_t attempt = 0;
  std::int64_t content = 0;
  Outcome outcome;
  std::int64_t duration_ns = 0;  ///< wall time of the evaluation
  bool operator==(const RolloutResult&) const = default;
};

/// W>L: results first_index .. first_index + n - 1 of this worker for this learner, and which of
/// the learner's last batches have come.
struct RewardBatch {
  WorkerId worker_id = 0;
  LearnerId learner_id = 0;
  std::int64_t last_batch = 0;        ///< highest sequence received from this learner
  std::int64_t batches_received = 0;  ///< bit i is set if the batch last_batch - i has come
  std::int32_t free_slots = 0;        ///< roll-outs it has room for beyond those it holds
  std::int64_t oldest_index = 0;      ///< results before it are settled, or given up
  std::int64_t first_index = 0;       ///< index of results[0]; 1, 2, ... for each learner
  std::vector<RolloutResult> results;
  bool operator==(const RewardBatch&) const = default;
};

/// What a worker holds for one learner from `first` to `last`: part of a heartbeat. What finds no
/// room is in the next message.
struct HeldRollouts {
  LearnerId learner_id = 0;
  std::int64_t last_batch = 0;
  std::int64_t last_index = 0;  ///< of its newest result for this learner
  std::vector<RolloutKey> keys;
  RolloutKey first = kFirstKey;
  RolloutKey last = kLastKey;
  bool operator==(const HeldRollouts&) const = default;
};

/// W>L: heartbeat, sent at start, several times a second, and last when draining.
struct WorkerStatus {
  WorkerId worker_id = 0;
  std::string host;
  std::int32_t pid = 0;
  std::string version;
  std::string numeric_class;  ///< workers of one class give the same bits for the same roll-out
  std::int32_t num_evaluators = 0;
  std::int32_t free_slots = 0;
  std::int32_t receive_buffer_bytes = 0;
  bool draining = false;  ///< takes no more roll-outs
  std::int64_t num_evaluated = 0;
  std::int64_t num_failed = 0;
  std::int64_t num_repeated = 0;  ///< answers given from the store
  std::int64_t num_restarts = 0;  ///< evaluators restarted
  std::int64_t num_rejected = 0;  ///< datagrams refused
  std::vector<HeldRollouts> held;
  bool operator==(const WorkerStatus&) const = default;
};

/// L>W: bytes of a task, a policy or a theta, which is more than one message may hold (pieces.h).
struct DefinitionPiece {
  LearnerId learner_id = 0;
  DefinitionName name;
  std::int32_t num_bytes = 0;  ///< of the whole
  std::int32_t index = 0;
  std::string bytes;
  bool operator==(const DefinitionPiece&) const = default;
};

/// Some of a definition's pieces, or all.
struct WantedDefinition {
  DefinitionName name;
  std::vector<std::int32_t> pieces;  ///< empty: all
  bool operator==(const WantedDefinition&) const = default;
};

/// W>L: what this worker was asked to use and does not have.
struct DefinitionRequest {
  WorkerId worker_id = 0;
  LearnerId learner_id = 0;
  std::vector<WantedDefinition> definitions;
  bool operator==(const DefinitionRequest&) const = default;
};

/// W>L: what became of a definition at this worker, sent whenever one arrives and again when a
/// roll-out is asked for under a definition it has refused.
struct DefinitionReport {
  WorkerId worker_id = 0;
  LearnerId learner_id = 0;
  ContentHash definition_id;
  bool accepted = false;
  std::string text;  ///< accepted task: its description as JSON; refused: why, for a person
  bool operator==(const DefinitionReport&) const = default;
};

/// L>*: the learner as a whole, once a second.
struct LearnerStatus {
  LearnerId learner_id = 0;
  std::string host;
  std::int32_t pid = 0;
  std::string study;
  std::string waiting_for;  ///< empty while roll-outs make progress
  double elapsed_s = 0;
  std::int32_t num_runs = 0;
  std::int32_t num_runs_done = 0;
  std::int32_t num_workers = 0;
  std::int32_t num_evaluators = 0;
  std::int64_t num_rollouts = 0;     ///< budget of the study
  std::int64_t num_evaluations = 0;  ///< outside the budget, of all runs
  std::int64_t num_evaluated = 0;    ///< of these, answered
  std::int64_t num_issued = 0;       ///< distinct roll-outs drawn: applied + pending
  std::int64_t num_applied = 0;
  std::int64_t num_pending = 0;
  std::int64_t num_late = 0;
  std::int64_t num_duplicate = 0;
  std::int64_t num_failed = 0;
  std::int64_t num_discarded = 0;  ///< trials that were void and were made again
  std::int64_t num_rejected = 0;
  std::int64_t num_reissued = 0;
  std::int64_t num_conflicting = 0;  ///< duplicates with another reward
  std::string last_failure;          ///< the roll-out and why; empty: none
  double best_reward = 0;
  bool operator==(const LearnerStatus&) const = default;
};

/// L>*: one run: what a person wants to see in lcm-spy. When something has changed (at most once a
/// second), and again now and then.
struct RunStatus {
  LearnerId learner_id = 0;
  std::int32_t run = 0;
  std::string condition;
  std::int32_t repetition = 0;
  std::int32_t layer = 0;
  std::int32_t num_rollouts = 0;
  std::int32_t num_applied = 0;
  std::int32_t num_failed = 0;
  std::int32_t num_switches = 0;
  double last_reward = 0;
  double mean_reward = 0;  ///< over the convergence window
  double best_reward = 0;
  double reward_slope = 0;     ///< per roll-out, over the convergence window
  double noise_deviation = 0;  ///< root of the mean variance of the exploration noise
  bool done = false;
  bool operator==(const RunStatus&) const = default;
};

/// L>*: the best policy of a run so far, each time it has become better (at most once a second),
/// and again now and then. It is cut into pieces as a definition is; each has a message.
struct BestPolicy {
  LearnerId learner_id = 0;
  std::int32_t run = 0;
  std::string condition;
  std::int32_t repetition = 0;
  std::int32_t rollout = 0;
  double reward = 0;
  ContentHash policy_id;
  std::int32_t policy_bytes = 0;  ///< of the whole
  std::int32_t index = 0;         ///< of the piece
  std::string policy;             ///< the piece's bytes of the JSON of common/policy/policy.h
  bool operator==(const BestPolicy&) const = default;
};

using Message =
    std::variant<RolloutBatch, RewardBatch, WorkerStatus, DefinitionPiece, DefinitionRequest,
                 DefinitionReport, LearnerStatus, RunStatus, BestPolicy>;

}  // namespace treeroll::protocol
