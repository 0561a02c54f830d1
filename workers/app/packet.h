#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/protocol/messages.h"

/// What daemon and evaluator say to each other over a SOCK_SEQPACKET socket: the messages of the
/// service, each as one packet of a byte for its channel and its LCM bytes.
namespace treeroll::worker {

enum class SendOutcome { kSent, kFull, kClosed };

/// Never raises SIGPIPE.
/// @param wait  false: kFull rather than wait for room
SendOutcome send_packet(int socket, const protocol::Message& message, bool wait);

struct Received {
  bool closed = false;     ///< the other side is gone
  bool malformed = false;  ///< a packet that is no message: the other side is not what it should be
  std::optional<protocol::Message> message;
};

/// @param wait  false: nothing of the above if no packet is there
Received receive_packet(int socket, bool wait);

}  // namespace treeroll::worker
