#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "common/protocol/messages.h"
#include "common/transport/bus.h"

namespace treeroll::transport {

inline constexpr std::array kAllChannels = {
    Channel::kRolloutBatch,    Channel::kRewardBatch,       Channel::kWorkerStatus,
    Channel::kDefinitionPiece, Channel::kDefinitionRequest, Channel::kDefinitionReport,
    Channel::kLearnerStatus,   Channel::kRunStatus,         Channel::kBestPolicy,
};
/// The same, as a bus takes them.
inline const std::vector<Channel> kEveryChannel(kAllChannels.begin(), kAllChannels.end());

/// Random messages that every rule allows, edge values included. Equal seeds give equal messages.
class MessageMaker {
 public:
  explicit MessageMaker(std::uint64_t seed) : random_(seed) {}

  protocol::Message make(Channel channel);

 private:
  template <class Integer>
  Integer any() {
    switch (below(4)) {
      case 0:
        return std::numeric_limits<Integer>::min();
      case 1:
        return std::numeric_limits<Integer>::max();
      case 2:
        return static_cast<Integer>(below(100));
      default:
        return static_cast<Integer>(random_());
    }
  }
  template <class Integer>
  Integer up_to(std::int64_t max) {
    return static_cast<Integer>(
        coin() ? (coin() ? max : 0)
               : static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(max)));
  }
  template <class Integer>
  Integer count() {
    const auto value = any<Integer>();
    return value < 0 ? ~value : value;
  }
  template <class Make>
  auto list(std::size_t size_max, Make make) {
    std::vector<decltype(make())> values;
    for (std::size_t size = below(size_max + 1); size > 0; --size) values.push_back(make());
    return values;
  }
  std::size_t below(std::size_t bound) { return random_() % bound; }
  bool coin() { return below(2) == 0; }
  double number();
  std::string text();
  /// Of any value.
  std::string bytes();
  protocol::DefinitionName name() {
    return {static_cast<protocol::DefinitionKind>(below(protocol::kNumDefinitionKinds)), hash()};
  }
  ContentHash hash();
  RolloutStatus status() { return static_cast<RolloutStatus>(below(kNumRolloutStatuses)); }
  protocol::RolloutKey key() { return {count<std::int32_t>(), any<std::int32_t>()}; }
  protocol::RolloutRequest request();
  protocol::RolloutResult result();
  protocol::RolloutBatch rollout_batch();
  protocol::RewardBatch reward_batch();
  protocol::WorkerStatus worker_status();
  protocol::DefinitionPiece definition_piece();
  protocol::DefinitionRequest definition_request();
  protocol::LearnerStatus learner_status();
  protocol::RunStatus run_status();
  protocol::BestPolicy best_policy();

  std::mt19937_64 random_;
};

}  // namespace treeroll::transport
