#include "tests/simulation/stranger.h"

#include "common/protocol/limits.h"
#include "common/transport/codec.h"
#include "common/transport/signature.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kStrangerDice = 70;
constexpr std::size_t kHeardMax = 500;
constexpr int kMadeUpIds = 40;

}  // namespace

Stranger::Stranger(std::uint64_t seed, bool has_keys)
    : dice_(seed, kStrangerDice),
      has_keys_(has_keys),
      insider_(has_keys ? Keys::kWorker : Keys::kNone, kInsidersHost),
      announcer_(has_keys ? Keys::kLearner : Keys::kNone, kInsidersHost) {}

Node::MessagePointer Stranger::answer(const Node::MessagePointer& heard) {
  if (recording_.size() < kHeardMax) recording_.push_back(heard);
  if (!has_keys_) return std::make_shared<const protocol::Message>(altered(*heard));
  if (dice_.chance(.3)) {
    return recording_[static_cast<std::size_t>(
        dice_.between(0, static_cast<int>(recording_.size()) - 1))];
  }
  const auto& datagram = static_cast<const Datagram&>(*heard);
  if (dice_.chance(.4)) return flipped(datagram);
  const auto* batch = std::get_if<protocol::RolloutBatch>(&*heard);
  if (batch != nullptr && dice_.chance(.5)) return as_a_learner(*batch);
  const protocol::Message made = altered(*heard);
  std::vector<std::byte> bytes = transport::encode(made);
  if (transport::is_of_worker(transport::channel_of(made)) && dice_.chance(.5)) {
    return insider_.seal(std::make_shared<const protocol::Message>(made));
  }
  // The signature of another one, or none.
  if (dice_.chance(.5))
    std::copy(datagram.bytes.end() - 32, datagram.bytes.end(), bytes.end() - 32);
  return std::make_shared<const Datagram>(made, std::move(bytes));
}

/// It hears nobody, so it knows no worker's key, as an insider knows no other's: in the learner's
/// name, ahead of its numbers, or in that of a worker, who would take itself for its learner.
Node::MessagePointer Stranger::as_a_learner(const protocol::RolloutBatch& heard) {
  protocol::RolloutBatch batch = heard;
  batch.sequence += dice_.between(0, 1'000'000);
  if (dice_.chance(.3)) batch.sequence = protocol::kRunningNumberMax;
  if (dice_.chance(.3)) batch.rollouts.clear();
  if (dice_.chance(.3)) batch.acknowledgements.clear();
  for (protocol::Acknowledgement& word : batch.acknowledgements) {
    word.seen_index = word.result_index = protocol::kRunningNumberMax;
  }
  if (!batch.rollouts.empty() && dice_.chance(.4)) {
    batch.learner_id = batch.rollouts.front().worker_id;
  }
  return announcer_.seal(std::make_shared<const protocol::Message>(std::move(batch)));
}

Node::MessagePointer Stranger::flipped(const Datagram& heard) {
  std::vector<std::byte> bytes = heard.bytes;
  const int bit = dice_.between(0, static_cast<int>(8 * bytes.size()) - 1);
  bytes[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::byte>(1U << (bit % 8));
  return std::make_shared<const Datagram>(heard, std::move(bytes));
}

/// Without keys nobody can tell a worker from who speaks in its name, acknowledges in it and all.
/// So he speaks in names of his own then, of which there are many.
protocol::Message Stranger::altered(const protocol::Message& heard) {
  protocol::Message message = heard;
  const std::int64_t made_up =
      Gate::name_of(has_keys_, kInsidersHost, dice_.between(1, kMadeUpIds));
  if (auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
    const bool in_anothers_name = has_keys_ && dice_.chance(.5);
    if (!in_anothers_name) batch->worker_id = made_up;
    for (protocol::RolloutResult& result : batch->results) {
      result.outcome = Outcome::ok(in_anothers_name ? 1e9 : .999);
    }
  } else if (auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    status->worker_id = made_up;
    status->host = "stranger\n";
    status->num_evaluators = 1024;
    status->free_slots = 4096;
    status->held.clear();
  } else if (auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    report->worker_id = made_up;
    report->text = dice_.chance(.5)
                       ? R"({"deterministic":true,"input_dim":9,"output_dim":9,"reward_max":1.0,)"
                         R"("reward_min":0.0,"time_limit_s":1.0})"
                       : "no";
    report->accepted = dice_.chance(.5);
  } else if (auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    request->worker_id = made_up;
  } else if (auto* learners = std::get_if<protocol::RolloutBatch>(&message)) {
    learners->learner_id = made_up;
    // A greeting. What such a learner settles is its own loss, and nobody keeps its books here.
    for (protocol::Acknowledgement& word : learners->acknowledgements) {
      word.seen_index = word.result_index = 0;
    }
  } else if (auto* piece = std::get_if<protocol::DefinitionPiece>(&message)) {
    piece->learner_id = made_up;
    if (!piece->bytes.empty()) piece->bytes[0] ^= 1;
  } else if (auto* learner = std::get_if<protocol::LearnerStatus>(&message)) {
    learner->learner_id = made_up;
  }
  return message;
}

}  // namespace treeroll::simulation
