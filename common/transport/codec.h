#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "common/transport/channel.h"

namespace treeroll::transport {

/// The bytes of the message's LCM type (fingerprint first, 16 MAC bytes last, zero). What breaks a
/// limit is encoded too: decode() and refusal() say so.
std::vector<std::byte> encode(const protocol::Message& message);

/// Why these bytes are no message of this channel, with the field, what is there and the rule
/// ("rollout_batch.rollouts[3].theta: count -1 is not within 0..4096"); empty if they are one.
/// Checks fingerprint, every count, size and string against common/protocol limits and every value
/// (enumerations, finite numbers, counts that are not negative, UTF-8) on the raw bytes.
std::optional<std::string> refusal(Channel channel, std::span<const std::byte> bytes);

/// The message, or refusal() as the error. No part of a refused message is allocated.
Result<protocol::Message> decode(Channel channel, std::span<const std::byte> bytes);

}  // namespace treeroll::transport
