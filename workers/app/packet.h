#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/protocol/messages.h"

/// What daemon and evaluator say to each other over a SOCK_SEQPACKET socket:
///
///   messages of the service, each as one packet of a byte for its channel and its LCM bytes;
///   definitions, each as a packet of a byte 255, a byte for its kind and its id; its content is
///   in a memory file that goes along, since a socket has no room for the largest while nobody
///   reads.
namespace treeroll::worker {

/// A task or a policy to be built, or to be forgotten if the content is empty.
struct DefinitionContent {
  protocol::DefinitionName name;
  std::string content;
};

enum class SendOutcome { kSent, kFull, kClosed };

/// Never raises SIGPIPE.
/// @param wait  false: kFull rather than wait for room
SendOutcome send_packet(int socket, const protocol::Message& message, bool wait);
SendOutcome send_packet(int socket, const DefinitionContent& definition, bool wait);

struct Received {
  bool closed = false;     ///< the other side is gone
  bool malformed = false;  ///< a packet that is neither: the other side is not what it should be
  /// One of them, if a packet was there.
  std::optional<protocol::Message> message;
  std::optional<DefinitionContent> definition;
};

/// @param wait  false: nothing of the above if no packet is there
Received receive_packet(int socket, bool wait);

}  // namespace treeroll::worker
