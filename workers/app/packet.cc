#include "workers/app/packet.h"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <span>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"

namespace treeroll::worker {

SendOutcome send_packet(int socket, const protocol::Message& message, bool wait) {
  std::vector<std::byte> packet{static_cast<std::byte>(transport::channel_of(message))};
  const std::vector<std::byte> bytes = transport::encode(message);
  packet.insert(packet.end(), bytes.begin(), bytes.end());
  const int flags = MSG_NOSIGNAL | (wait ? 0 : MSG_DONTWAIT);
  while (send(socket, packet.data(), packet.size(), flags) < 0) {
    if (errno == EINTR) continue;
    return errno == EAGAIN || errno == ENOBUFS ? SendOutcome::kFull : SendOutcome::kClosed;
  }
  return SendOutcome::kSent;
}

Received receive_packet(int socket, bool wait) {
  Received received;
  std::vector<std::byte> packet(protocol::kMessageBytesMax + 1024);
  const int flags = MSG_TRUNC | (wait ? 0 : MSG_DONTWAIT);
  ssize_t size = 0;
  do {
    size = recv(socket, packet.data(), packet.size(), flags);
  } while (size < 0 && errno == EINTR);
  if (size < 0 && errno == EAGAIN) return received;
  received.closed = size <= 0;
  if (received.closed) return received;
  const auto channel = std::to_integer<int>(packet[0]);
  received.malformed =
      static_cast<std::size_t>(size) > packet.size() || channel >= transport::kNumChannels;
  if (received.malformed) return received;
  auto message =
      transport::decode(static_cast<transport::Channel>(channel),
                        std::span(packet).first(static_cast<std::size_t>(size)).subspan(1));
  received.malformed = !message;
  if (message) received.message = std::move(*message);
  return received;
}

}  // namespace treeroll::worker
