#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "common/transport/bus.h"

namespace treeroll::transport {

Channel channel_of(const protocol::Message& message);

/// The bytes of the message's LCM type (fingerprint first, 16 MAC bytes last).
std::vector<std::byte> encode(const protocol::Message& message);

/// Checks fingerprint, every count, size and string on the raw bytes against common/protocol
/// limits, then decodes; then checks values (enumerations, finite numbers). Nothing is allocated
/// for a message that is refused.
Result<protocol::Message> decode(Channel channel, std::span<const std::byte> bytes);

}  // namespace treeroll::transport
