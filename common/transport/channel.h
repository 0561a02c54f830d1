#pragma once

#include <string_view>
#include <variant>

#include "common/protocol/messages.h"

namespace treeroll::transport {

/// One per message type, in the order of protocol::Message. What each is called on the wire stands
/// beside the fields of its message, in wire_fields.h.
enum class Channel {
  kRolloutBatch,
  kRewardBatch,
  kWorkerStatus,
  kDefinitionPiece,
  kDefinitionRequest,
  kDefinitionReport,
  kLearnerStatus,
  kRunStatus,
  kBestPolicy,
};
inline constexpr int kNumChannels = static_cast<int>(std::variant_size_v<protocol::Message>);

/// All names begin with this, which the kernel's filter looks for first.
inline constexpr std::string_view kChannelPrefix = "TREEROLL";
const char* channel_name(Channel channel);

Channel channel_of(const protocol::Message& message);

}  // namespace treeroll::transport
