#include "common/transport/lcm_bus.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"

namespace treeroll::transport {

LcmBus::LcmBus(LcmHandle lcm, LcmUrl url, BusOptions options)
    : lcm_(std::move(lcm)), url_(std::move(url)), options_(std::move(options)) {}

void LcmBus::publish(const protocol::Message& message) {
  const Channel channel = channel_of(message);
  const std::vector<std::byte> bytes = encode(message);
  // What every receiver would refuse is not sent: size, limits, a reward that is no number.
  auto problem = refusal(channel, bytes);
  if (!problem) problem = send(channel, bytes);
  if (!problem) {
    ++statistics_.num_published;
    return;
  }
  ++statistics_.num_unsent;
  statistics_.last_publish_error = fmt::format("{}: {}", channel_name(channel), *problem);
}

std::optional<std::string> LcmBus::send(Channel channel, const std::vector<std::byte>& bytes) {
  errno = 0;
  if (lcm_publish(lcm_.get(), channel_name(channel), bytes.data(),
                  static_cast<unsigned>(bytes.size())) == 0) {
    return std::nullopt;
  }
  return fmt::format("sending {} bytes failed: {}", bytes.size(),
                     errno == 0 ? "liblcm does not say why" : std::strerror(errno));
}

std::size_t LcmBus::batch_bytes_max() const {
  // Small batches are for datagrams, whose fragments are lost one by one.
  const bool fragments = url_.provider == Provider::kUdpm && url_.ttl > 0;
  return fragments ? protocol::kBatchBytesRemoteMax : protocol::kBatchBytesLocalMax;
}

void LcmBus::take(Channel channel, std::span<const std::byte> bytes) {
  const Result<protocol::Message> message = decode(channel, bytes);
  if (!message) {
    ++statistics_.num_rejected;
    statistics_.last_rejection = message.error().message;
    return;
  }
  ++statistics_.num_received;
  options_.on_message(*message);
}

}  // namespace treeroll::transport
