#pragma once

#include <linux/filter.h>

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/transport/channel.h"

namespace treeroll::transport {

/// LCM's short message, as one datagram:
///
///   'L' 'C' '0' '2' | sequence number, 4 bytes | channel, at most 63 bytes, NUL | payload
///
/// What does not fit a datagram LCM sends as several with the magic 'LC03'; those are not taken.
struct ShortFrame {
  std::string_view channel;            ///< into the datagram
  std::span<const std::byte> payload;  ///< into the datagram
};

/// Empty if the datagram is no short message.
std::optional<ShortFrame> read_short_frame(std::span<const std::byte> datagram);

/// Program for the kernel (SO_ATTACH_FILTER on a UDP socket) that passes only short messages on
/// these channels: what one does not want never wakes this process. With no channels, nothing
/// passes.
std::vector<sock_filter> short_frame_filter(std::span<const Channel> channels);

}  // namespace treeroll::transport
