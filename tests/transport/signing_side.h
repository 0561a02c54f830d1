#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/transport/authenticator.h"
#include "common/transport/codec.h"

/// Processes that sign, for tests of what they make of each other.
namespace treeroll::transport {

inline constexpr std::int64_t kLearner = 77;
/// Of hosts 1 and 2: their names begin as the ids of their keys do.
inline constexpr std::int64_t kHost = std::int64_t{1} << 40U;
inline constexpr std::int64_t kWorker = kHost + 5;
inline constexpr std::int64_t kOther = 2 * kHost + 6;

inline Key learner_key(unsigned char first = 1) {
  Key key{};
  for (std::size_t i = 0; i < key.size(); ++i) key.at(i) = static_cast<unsigned char>(first + i);
  return key;
}

inline KeyRing ring(const std::string& lines) {
  auto keys = KeyRing::parse(lines);
  EXPECT_TRUE(keys) << keys.error().message;
  return *std::move(keys);
}
inline KeyRing learner_ring(unsigned char first = 1) { return ring(line_of(learner_key(first))); }
inline KeyRing worker_ring(std::int64_t host, unsigned char first = 1) {
  return ring(line_of(worker_key(learner_key(first), host * kHost)));
}

struct Signed {
  Channel channel{};
  std::vector<std::byte> bytes;
};

/// A process: signs, and says what it makes of what it hears.
struct Side {
  explicit Side(KeyRing keys, bool only_watches = false)
      : authenticator(std::move(keys), only_watches) {}

  Signed say(const protocol::Message& message) {
    Signed datagram{channel_of(message), encode(message)};
    authenticator.sign(message, datagram.bytes);
    EXPECT_EQ(refusal(datagram.channel, datagram.bytes), std::nullopt);
    return datagram;
  }

  /// Under an index of its choice. Precondition: a learner's ring, which has heard nobody.
  Signed say_as_number(const protocol::Message& message, std::int64_t index) {
    authenticator = Authenticator(learner_ring(), false, index - 1);
    return say(message);
  }

  std::string hear(const Signed& datagram) {
    if (auto why = authenticator.refusal(datagram.channel, datagram.bytes)) return *why;
    const auto message = decode(datagram.channel, datagram.bytes);
    if (!message) return "no message";
    switch (authenticator.admit(*message, datagram.bytes)) {
      case Authenticator::Admission::kTaken:
        return "taken";
      case Authenticator::Admission::kUnproven:
        return "unproven";
      case Authenticator::Admission::kReplayed:
        return "replayed";
      case Authenticator::Admission::kForged:
        return "forged";
    }
    return "";
  }

  Authenticator authenticator;
};

inline protocol::WorkerStatus status_of(std::int64_t worker) {
  protocol::WorkerStatus status;
  status.worker_id = worker;
  return status;
}

/// Names them in a word to each.
inline protocol::RolloutBatch batch_to(const std::vector<std::int64_t>& workers,
                                       std::int64_t learner = kLearner) {
  protocol::RolloutBatch batch;
  batch.learner_id = learner;
  for (const std::int64_t worker : workers) batch.acknowledgements.push_back({worker, 0, 0});
  return batch;
}

inline protocol::RolloutBatch lease_to(std::int64_t worker) {
  protocol::RolloutBatch batch = batch_to({});
  batch.rollouts.resize(1);
  batch.rollouts[0].worker_id = worker;
  batch.rollouts[0].theta = {1, 2, 3};
  return batch;
}

inline protocol::RewardBatch answer(std::int64_t worker, std::int64_t learner = kLearner) {
  protocol::RewardBatch batch;
  batch.worker_id = worker;
  batch.learner_id = learner;
  return batch;
}

inline protocol::DefinitionPiece piece() {
  protocol::DefinitionPiece piece;
  piece.learner_id = kLearner;
  return piece;
}

inline protocol::LearnerStatus learner_status() {
  protocol::LearnerStatus status;
  status.learner_id = kLearner;
  return status;
}

/// A learner and a worker that have met.
struct MetPair {
  Side learner{learner_ring()};
  Side worker{worker_ring(1)};

  MetPair() {
    EXPECT_EQ(learner.hear(worker.say(status_of(kWorker))), "taken");
    EXPECT_EQ(worker.hear(learner.say(batch_to({kWorker}))), "taken");
  }
};

}  // namespace treeroll::transport
