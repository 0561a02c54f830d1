#include "common/transport/lcm_bus.h"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "common/transport/codec.h"

namespace treeroll::transport {
namespace {

/// Between two looks at the key file.
constexpr Duration kKeysPeriod = std::chrono::seconds(2);

}  // namespace

LcmBus::LcmBus(Loop& loop, LcmHandle lcm, LcmUrl url, BusOptions options)
    : lcm_(std::move(lcm)),
      url_(std::move(url)),
      options_(std::move(options)),
      keys_loop_(loop),
      keys_timer_(loop, [this] { look_at_keys(); }) {
  if (!options_.key_file) return;
  authenticator_.emplace(options_.key_file->keys(), options_.only_watches);
  keys_timer_.set(keys_loop_.now() + kKeysPeriod);
}

void LcmBus::look_at_keys() {
  keys_timer_.set(keys_loop_.now() + kKeysPeriod);
  const Result<bool> has_changed = options_.key_file->look_again();
  if (!has_changed) {
    statistics_.key_file_error = has_changed.error().message;
  } else if (*has_changed) {
    statistics_.key_file_error.clear();
    authenticator_->set_keys(options_.key_file->keys());
  }
}

void LcmBus::publish(const protocol::Message& message) {
  const Channel channel = channel_of(message);
  std::vector<std::byte> bytes = encode(message);
  if (authenticator_) authenticator_->sign(message, bytes);
  // What every receiver would refuse is not sent: size, limits, a reward that is no number.
  auto problem = refusal(channel, bytes);
  if (!problem) problem = past_frame(channel, bytes.size());
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
  return crosses_hosts() ? protocol::kBatchBytesRemoteMax : protocol::kBatchBytesLocalMax;
}

std::size_t LcmBus::word_bytes() const { return authenticator_ ? protocol::kWordMacBytes : 0; }

/// What no frame holds is not sent across hosts: senders cut it, and a path that drops fragments
/// would only show it after a while.
std::optional<std::string> LcmBus::past_frame(Channel channel, std::size_t num_bytes) const {
  if (!crosses_hosts()) return std::nullopt;
  const std::size_t size =
      protocol::kFrameHeaderBytes + std::strlen(channel_name(channel)) + 1 + num_bytes;
  if (size <= protocol::kBatchBytesRemoteMax) return std::nullopt;
  return fmt::format("{} bytes are more than one frame holds, {}", size,
                     protocol::kBatchBytesRemoteMax);
}

void LcmBus::reject(std::string why) {
  ++statistics_.num_rejected;
  statistics_.last_rejection = std::move(why);
}

void LcmBus::take(Channel channel, std::span<const std::byte> bytes) {
  if (authenticator_) {
    if (auto why = authenticator_->refusal(channel, bytes)) return reject(*std::move(why));
  }
  Result<protocol::Message> message = decode(channel, bytes);
  if (!message) return reject(message.error().message);
  if (authenticator_) {
    const Authenticator::Admission admission = authenticator_->admit(*message, bytes);
    if (admission == Authenticator::Admission::kForged) {
      return reject(
          fmt::format("{}: names us, and has not signed it with our key", channel_name(channel)));
    }
    if (admission == Authenticator::Admission::kReplayed) ++statistics_.num_replayed;
    if (admission != Authenticator::Admission::kTaken) return;
  }
  ++statistics_.num_received;
  if (options_.on_bytes) options_.on_bytes(channel, bytes);
  options_.on_message(*std::move(message));
}

}  // namespace treeroll::transport
