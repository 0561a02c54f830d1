#pragma once

#include <type_traits>

#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "common/transport/channel.h"
#include "treeroll/best_policy_t.hpp"
#include "treeroll/definition_piece_t.hpp"
#include "treeroll/definition_report_t.hpp"
#include "treeroll/definition_request_t.hpp"
#include "treeroll/learner_status_t.hpp"
#include "treeroll/reward_batch_t.hpp"
#include "treeroll/rollout_batch_t.hpp"
#include "treeroll/run_status_t.hpp"
#include "treeroll/worker_status_t.hpp"

/// The one place that says which field of an LCM type is which field of a message, and the rule
/// for it; and, of a message, on which channel it travels. Each `visit` names the fields in the
/// order in which lcm-gen writes them; the visitor copies one way (codec.cc), or the other, or
/// checks the raw bytes (wire_check.h). A field that is forgotten or out of order fails the round
/// trip of every message in tests/transport.
///
/// What a visitor is asked, with the field's name, the message's field and the LCM field:
///   count        an integer that is not negative
///   bounded      the same, with a highest value
///   integer      any integer
///   number       a finite double
///   flag         a boolean
///   outcome      an Outcome: reward, status and reason, a string as `text`
///   kind         a DefinitionKind
///   hash         16 bytes
///   text         a UTF-8 string of at most so many bytes, without a NUL
///   record       a part
///   records      a list of at most so many parts, with the field that counts them
///   numbers      a list of at most so many finite doubles
///   integers     a list of at most so many integers within 0 and a highest value
///   maybe_hash   16 bytes or none
///   bytes        at most so many bytes of any value
///   word_macs    authentication codes for the workers that are named; Authenticator writes them
///   signature    key, index and authentication code, which messages do not carry either
namespace treeroll::transport::wire {

template <class Message>
struct Fields;

template <>
struct Fields<protocol::RolloutKey> {
  using Wire = rollout_key_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.count("run", m.run, w.run);
    v.integer("number", m.number, w.number);
  }
};

template <>
struct Fields<protocol::RolloutRequest> {
  using Wire = rollout_request_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.record("key", m.key, w.key);
    v.count("attempt", m.attempt, w.attempt);
    v.integer("content", m.content, w.content);
    v.hash("task_id", m.task_id, w.task_id);
    v.hash("policy_id", m.policy_id, w.policy_id);
    v.integer("task_seed", m.task_seed, w.task_seed);
    v.numbers("theta", m.theta, w.theta_dim, w.theta, protocol::kThetaDimMax);
    v.maybe_hash("theta_ids", m.theta_id, w.num_theta_ids, w.theta_ids);
  }
};

template <>
struct Fields<protocol::Acknowledgement> {
  using Wire = acknowledgement_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.count("seen_index", m.seen_index, w.seen_index);
    v.count("result_index", m.result_index, w.result_index);
  }
};

template <>
struct Fields<protocol::RolloutBatch> {
  using Wire = rollout_batch_t;
  static constexpr Channel kChannel = Channel::kRolloutBatch;
  static constexpr const char* kChannelName = "TREEROLL_ROLLOUTS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.bounded("sequence", m.sequence, w.sequence, protocol::kRunningNumberMax);
    v.records("rollouts", m.rollouts, w.num_rollouts, w.rollouts, protocol::kRolloutsPerBatchMax);
    v.records("acknowledgements", m.acknowledgements, w.num_acknowledgements, w.acknowledgements,
              protocol::kAcknowledgementsPerBatchMax);
    v.word_macs("word_macs", w.num_word_macs, w.word_macs, protocol::kNamedPerBatchMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::RolloutResult> {
  using Wire = rollout_result_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.record("key", m.key, w.key);
    v.count("attempt", m.attempt, w.attempt);
    v.integer("content", m.content, w.content);
    v.outcome(m.outcome, w.reward, w.status, w.reason, protocol::kReasonBytesMax);
    v.bounded("duration_ns", m.duration_ns, w.duration_ns, protocol::kDurationNsMax);
  }
};

template <>
struct Fields<protocol::RewardBatch> {
  using Wire = reward_batch_t;
  static constexpr Channel kChannel = Channel::kRewardBatch;
  static constexpr const char* kChannelName = "TREEROLL_REWARDS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.count("learner_id", m.learner_id, w.learner_id);
    v.bounded("last_batch", m.last_batch, w.last_batch, protocol::kRunningNumberMax);
    v.integer("batches_received", m.batches_received, w.batches_received);
    v.bounded("free_slots", m.free_slots, w.free_slots, protocol::kHeldPerMessageMax);
    v.bounded("oldest_index", m.oldest_index, w.oldest_index, protocol::kRunningNumberMax);
    v.bounded("first_index", m.first_index, w.first_index, protocol::kRunningNumberMax);
    v.records("results", m.results, w.num_results, w.results, protocol::kResultsPerBatchMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::HeldRollouts> {
  using Wire = held_rollouts_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.bounded("last_batch", m.last_batch, w.last_batch, protocol::kRunningNumberMax);
    v.bounded("last_index", m.last_index, w.last_index, protocol::kRunningNumberMax);
    v.records("keys", m.keys, w.num_keys, w.keys, protocol::kHeldPerMessageMax);
    v.record("first", m.first, w.first);
    v.record("last", m.last, w.last);
  }
};

template <>
struct Fields<protocol::WorkerStatus> {
  using Wire = worker_status_t;
  static constexpr Channel kChannel = Channel::kWorkerStatus;
  static constexpr const char* kChannelName = "TREEROLL_WORKERS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.text("host", m.host, w.host, protocol::kNameBytesMax);
    v.count("pid", m.pid, w.pid);
    v.text("version", m.version, w.version, protocol::kNameBytesMax);
    v.text("numeric_class", m.numeric_class, w.numeric_class, protocol::kNameBytesMax);
    v.bounded("num_evaluators", m.num_evaluators, w.num_evaluators,
              protocol::kEvaluatorsPerWorkerMax);
    v.bounded("free_slots", m.free_slots, w.free_slots, protocol::kHeldPerMessageMax);
    v.count("receive_buffer_bytes", m.receive_buffer_bytes, w.receive_buffer_bytes);
    v.flag("draining", m.draining, w.draining);
    v.count("num_evaluated", m.num_evaluated, w.num_evaluated);
    v.count("num_failed", m.num_failed, w.num_failed);
    v.count("num_repeated", m.num_repeated, w.num_repeated);
    v.count("num_restarts", m.num_restarts, w.num_restarts);
    v.count("num_rejected", m.num_rejected, w.num_rejected);
    v.records("held", m.held, w.num_held, w.held, protocol::kLearnersPerStatusMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::DefinitionPiece> {
  using Wire = definition_piece_t;
  static constexpr Channel kChannel = Channel::kDefinitionPiece;
  static constexpr const char* kChannelName = "TREEROLL_DEFINITIONS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.kind("kind", m.name.kind, w.kind);
    v.hash("definition_id", m.name.id, w.definition_id);
    v.bounded("total_bytes", m.num_bytes, w.total_bytes, protocol::kDefinitionBytesMax);
    v.bounded("index", m.index, w.index, protocol::kPiecesMax - 1);
    v.bytes("piece", m.bytes, w.num_bytes, w.piece, protocol::kPieceBytes);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::WantedDefinition> {
  using Wire = wanted_definition_t;
  static void visit(auto& v, auto& m, auto& w) {
    v.kind("kind", m.name.kind, w.kind);
    v.hash("definition_id", m.name.id, w.definition_id);
    v.integers("pieces", m.pieces, w.num_pieces, w.pieces, protocol::kPiecesMax,
               protocol::kPiecesMax - 1);
  }
};

template <>
struct Fields<protocol::DefinitionRequest> {
  using Wire = definition_request_t;
  static constexpr Channel kChannel = Channel::kDefinitionRequest;
  static constexpr const char* kChannelName = "TREEROLL_REQUESTS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.count("learner_id", m.learner_id, w.learner_id);
    v.records("definitions", m.definitions, w.num_definitions, w.definitions,
              protocol::kDefinitionsPerRequestMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::DefinitionReport> {
  using Wire = definition_report_t;
  static constexpr Channel kChannel = Channel::kDefinitionReport;
  static constexpr const char* kChannelName = "TREEROLL_REPORTS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("worker_id", m.worker_id, w.worker_id);
    v.count("learner_id", m.learner_id, w.learner_id);
    v.hash("definition_id", m.definition_id, w.definition_id);
    v.flag("accepted", m.accepted, w.accepted);
    v.text("text", m.text, w.text, protocol::kStringBytesMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::LearnerStatus> {
  using Wire = learner_status_t;
  static constexpr Channel kChannel = Channel::kLearnerStatus;
  static constexpr const char* kChannelName = "TREEROLL_LEARNER";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.text("host", m.host, w.host, protocol::kNameBytesMax);
    v.count("pid", m.pid, w.pid);
    v.text("study", m.study, w.study, protocol::kNameBytesMax);
    v.text("waiting_for", m.waiting_for, w.waiting_for, protocol::kStringBytesMax);
    v.number("elapsed_s", m.elapsed_s, w.elapsed_s);
    v.count("num_runs", m.num_runs, w.num_runs);
    v.count("num_runs_done", m.num_runs_done, w.num_runs_done);
    v.count("num_workers", m.num_workers, w.num_workers);
    v.count("num_evaluators", m.num_evaluators, w.num_evaluators);
    v.count("num_rollouts", m.num_rollouts, w.num_rollouts);
    v.count("num_evaluations", m.num_evaluations, w.num_evaluations);
    v.count("num_evaluated", m.num_evaluated, w.num_evaluated);
    v.count("num_issued", m.num_issued, w.num_issued);
    v.count("num_applied", m.num_applied, w.num_applied);
    v.count("num_pending", m.num_pending, w.num_pending);
    v.count("num_late", m.num_late, w.num_late);
    v.count("num_duplicate", m.num_duplicate, w.num_duplicate);
    v.count("num_failed", m.num_failed, w.num_failed);
    v.count("num_discarded", m.num_discarded, w.num_discarded);
    v.count("num_rejected", m.num_rejected, w.num_rejected);
    v.count("num_reissued", m.num_reissued, w.num_reissued);
    v.count("num_conflicting", m.num_conflicting, w.num_conflicting);
    v.number("best_reward", m.best_reward, w.best_reward);
    v.text("last_failure", m.last_failure, w.last_failure, protocol::kStringBytesMax);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::RunStatus> {
  using Wire = run_status_t;
  static constexpr Channel kChannel = Channel::kRunStatus;
  static constexpr const char* kChannelName = "TREEROLL_RUNS";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.count("run", m.run, w.run);
    v.text("condition", m.condition, w.condition, protocol::kNameBytesMax);
    v.count("repetition", m.repetition, w.repetition);
    v.count("layer", m.layer, w.layer);
    v.count("num_rollouts", m.num_rollouts, w.num_rollouts);
    v.count("num_applied", m.num_applied, w.num_applied);
    v.count("num_failed", m.num_failed, w.num_failed);
    v.count("num_switches", m.num_switches, w.num_switches);
    v.number("last_reward", m.last_reward, w.last_reward);
    v.number("mean_reward", m.mean_reward, w.mean_reward);
    v.number("best_reward", m.best_reward, w.best_reward);
    v.number("reward_slope", m.reward_slope, w.reward_slope);
    v.number("noise_deviation", m.noise_deviation, w.noise_deviation);
    v.flag("done", m.done, w.done);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

template <>
struct Fields<protocol::BestPolicy> {
  using Wire = best_policy_t;
  static constexpr Channel kChannel = Channel::kBestPolicy;
  static constexpr const char* kChannelName = "TREEROLL_BEST";
  static void visit(auto& v, auto& m, auto& w) {
    v.count("learner_id", m.learner_id, w.learner_id);
    v.count("run", m.run, w.run);
    v.text("condition", m.condition, w.condition, protocol::kNameBytesMax);
    v.count("repetition", m.repetition, w.repetition);
    v.integer("rollout", m.rollout, w.rollout);
    v.number("reward", m.reward, w.reward);
    v.hash("policy_id", m.policy_id, w.policy_id);
    v.bounded("total_bytes", m.policy_bytes, w.total_bytes, protocol::kDefinitionBytesMax);
    v.bounded("index", m.index, w.index, protocol::kPiecesMax - 1);
    v.bytes("piece", m.policy, w.num_bytes, w.piece, protocol::kPieceBytes);
    v.signature(w.key_id, w.signed_index, w.mac);
  }
};

}  // namespace treeroll::transport::wire
