#include "tests/transport/message_maker.h"

#include <bit>
#include <cmath>

#include "common/protocol/limits.h"

namespace treeroll::transport {

using namespace protocol;  // NOLINT(google-build-using-namespace)

double MessageMaker::number() {
  constexpr std::array kEdges = {0.0,
                                 -0.0,
                                 1.0,
                                 std::numeric_limits<double>::max(),
                                 std::numeric_limits<double>::lowest(),
                                 std::numeric_limits<double>::denorm_min()};
  if (coin()) return kEdges[below(kEdges.size())];
  const double value = std::bit_cast<double>(random_());
  return std::isfinite(value) ? value : 0.5;
}

std::string MessageMaker::text() {
  constexpr std::array kPieces = {
      "", "a", "{\"name\": \"x\"}", "\n", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\x8c\xb3"};
  std::string text;
  for (std::size_t i = below(8); i > 0; --i) text += kPieces[below(kPieces.size())];
  return text;
}

std::string MessageMaker::bytes() {
  std::string bytes;
  for (std::size_t i = below(8); i > 0; --i) bytes.push_back(static_cast<char>(below(256)));
  return bytes;
}

ContentHash MessageMaker::hash() {
  ContentHash hash;
  for (auto& byte : hash.bytes) byte = static_cast<std::uint8_t>(random_());
  return hash;
}

RolloutRequest MessageMaker::request() {
  RolloutRequest m;
  m.worker_id = count<std::int64_t>();
  m.key = key();
  m.attempt = count<std::int32_t>();
  m.content = any<std::int64_t>();
  m.task_id = hash();
  m.policy_id = hash();
  m.task_seed = any<std::int64_t>();
  m.theta = list(12, [this] { return number(); });
  if (coin()) m.theta_id = hash();
  return m;
}

RolloutResult MessageMaker::result() {
  RolloutResult m;
  m.key = key();
  m.attempt = count<std::int32_t>();
  m.content = any<std::int64_t>();
  m.outcome = {number(), status(), text()};
  m.duration_ns = up_to<std::int64_t>(kDurationNsMax);
  return m;
}

RolloutBatch MessageMaker::rollout_batch() {
  RolloutBatch m;
  m.learner_id = count<std::int64_t>();
  m.sequence = up_to<std::int64_t>(kRunningNumberMax);
  m.rollouts = list(5, [this] { return request(); });
  m.acknowledgements = list(3, [this] {
    return Acknowledgement{count<std::int64_t>(), count<std::int64_t>(), count<std::int64_t>()};
  });
  return m;
}

RewardBatch MessageMaker::reward_batch() {
  RewardBatch m;
  m.worker_id = count<std::int64_t>();
  m.learner_id = count<std::int64_t>();
  m.last_batch = up_to<std::int64_t>(kRunningNumberMax);
  m.batches_received = up_to<std::int64_t>(INT64_MAX);
  m.free_slots = up_to<std::int32_t>(kHeldPerMessageMax);
  m.oldest_index = up_to<std::int64_t>(kRunningNumberMax);
  m.first_index = up_to<std::int64_t>(kRunningNumberMax);
  m.results = list(5, [this] { return result(); });
  return m;
}

WorkerStatus MessageMaker::worker_status() {
  WorkerStatus m;
  m.worker_id = count<std::int64_t>();
  m.host = text();
  m.pid = count<std::int32_t>();
  m.version = text();
  m.numeric_class = text();
  m.num_evaluators = up_to<std::int32_t>(kEvaluatorsPerWorkerMax);
  m.free_slots = up_to<std::int32_t>(kHeldPerMessageMax);
  m.receive_buffer_bytes = count<std::int32_t>();
  m.draining = coin();
  m.num_evaluated = count<std::int64_t>();
  m.num_failed = count<std::int64_t>();
  m.num_repeated = count<std::int64_t>();
  m.num_restarts = count<std::int64_t>();
  m.num_rejected = count<std::int64_t>();
  m.held = list(3, [this] {
    return HeldRollouts{count<std::int64_t>(),
                        up_to<std::int64_t>(kRunningNumberMax),
                        up_to<std::int64_t>(kRunningNumberMax),
                        list(4, [this] { return key(); }),
                        key(),
                        key()};
  });
  return m;
}

DefinitionPiece MessageMaker::definition_piece() {
  DefinitionPiece m;
  m.learner_id = count<std::int64_t>();
  m.name = name();
  m.num_bytes = up_to<std::int32_t>(kDefinitionBytesMax);
  m.index = up_to<std::int32_t>(kPiecesMax - 1);
  m.bytes = bytes();
  return m;
}

DefinitionRequest MessageMaker::definition_request() {
  DefinitionRequest m;
  m.worker_id = count<std::int64_t>();
  m.learner_id = count<std::int64_t>();
  m.definitions = list(3, [this] {
    return WantedDefinition{name(),
                            list(4, [this] { return up_to<std::int32_t>(kPiecesMax - 1); })};
  });
  return m;
}

LearnerStatus MessageMaker::learner_status() {
  LearnerStatus m;
  m.learner_id = count<std::int64_t>();
  m.host = text();
  m.pid = count<std::int32_t>();
  m.study = text();
  m.waiting_for = text();
  m.elapsed_s = number();
  for (auto* field : {&m.num_runs, &m.num_runs_done, &m.num_workers, &m.num_evaluators}) {
    *field = count<std::int32_t>();
  }
  for (auto* field : {&m.num_rollouts, &m.num_evaluations, &m.num_evaluated, &m.num_issued,
                      &m.num_applied, &m.num_pending, &m.num_late, &m.num_duplicate, &m.num_failed,
                      &m.num_discarded, &m.num_rejected, &m.num_reissued, &m.num_conflicting}) {
    *field = count<std::int64_t>();
  }
  m.best_reward = number();
  m.last_failure = text();
  return m;
}

RunStatus MessageMaker::run_status() {
  RunStatus m;
  m.learner_id = count<std::int64_t>();
  m.condition = text();
  for (auto* field : {&m.run, &m.repetition, &m.layer, &m.num_rollouts, &m.num_applied,
                      &m.num_failed, &m.num_switches}) {
    *field = count<std::int32_t>();
  }
  for (auto* field :
       {&m.last_reward, &m.mean_reward, &m.best_reward, &m.reward_slope, &m.noise_deviation}) {
    *field = number();
  }
  m.done = coin();
  return m;
}

BestPolicy MessageMaker::best_policy() {
  BestPolicy m;
  m.learner_id = count<std::int64_t>();
  m.run = count<std::int32_t>();
  m.condition = text();
  m.repetition = count<std::int32_t>();
  m.rollout = any<std::int32_t>();
  m.reward = number();
  m.policy_id = hash();
  m.policy_bytes = up_to<std::int32_t>(kDefinitionBytesMax);
  m.index = up_to<std::int32_t>(kPiecesMax - 1);
  m.policy = bytes();
  return m;
}

Message MessageMaker::make(Channel channel) {
  switch (channel) {
    case Channel::kRolloutBatch:
      return rollout_batch();
    case Channel::kRewardBatch:
      return reward_batch();
    case Channel::kWorkerStatus:
      return worker_status();
    case Channel::kDefinitionPiece:
      return definition_piece();
    case Channel::kDefinitionRequest:
      return definition_request();
    case Channel::kDefinitionReport:
      return DefinitionReport{count<std::int64_t>(), count<std::int64_t>(), hash(), coin(), text()};
    case Channel::kLearnerStatus:
      return learner_status();
    case Channel::kRunStatus:
      return run_status();
    case Channel::kBestPolicy:
      return best_policy();
  }
  return RolloutBatch{};
}

}  // namespace treeroll::transport
