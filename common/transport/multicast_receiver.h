#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/transport/bus.h"
#include "common/transport/lcm_url.h"
#include "common/transport/loop.h"

namespace treeroll::transport {

/// Receives LCM's short messages of a multicast group in the loop, without liblcm's receive thread.
/// Bound to the group's address, so that other groups on the same port are not heard; other
/// processes, lcm-spy and lcm-logger among them, may listen beside it.
class MulticastReceiver {
 public:
  /// Called for each short message on a wanted channel, in the loop; the bytes are good for the
  /// call. Must not throw.
  using OnMessage = std::function<void(Channel, std::span<const std::byte> payload)>;

  /// @param url  udpm
  static Result<std::unique_ptr<MulticastReceiver>> open(Loop& loop, const LcmUrl& url,
                                                         std::vector<Channel> channels,
                                                         OnMessage on_message);
  ~MulticastReceiver();
  MulticastReceiver(const MulticastReceiver&) = delete;
  MulticastReceiver& operator=(const MulticastReceiver&) = delete;

  /// Room the kernel gave for datagrams that wait to be read. The kernel doubles what one asks for
  /// to pay its own overhead; this is the half that is for messages.
  std::int32_t receive_buffer_bytes() const { return receive_buffer_bytes_; }
  /// Datagrams that passed the kernel's filter and are no short message on a wanted channel.
  std::int64_t num_foreign() const { return num_foreign_; }

 private:
  MulticastReceiver(Loop& loop, int descriptor, std::vector<Channel> channels,
                    OnMessage on_message);
  void drain();
  void take(std::span<const std::byte> datagram);

  Loop& loop_;
  int descriptor_;
  std::vector<Channel> channels_;
  OnMessage on_message_;
  std::int32_t receive_buffer_bytes_ = 0;
  std::int64_t num_foreign_ = 0;
  std::vector<std::byte> buffer_;
};

/// Fails if a datagram to the URL's group would find no route, with the command that adds one.
/// liblcm reports this as it reports a bad URL.
Result<bool> probe_multicast_route(const LcmUrl& url);

}  // namespace treeroll::transport
