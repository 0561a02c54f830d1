#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "common/transport/channel.h"
#include "common/transport/key_file.h"

namespace treeroll::transport {

class Loop;

/// What the bus has seen; all counts since it was opened.
struct BusStatistics {
  std::int64_t num_published = 0;
  std::int64_t num_unsent = 0;     ///< messages that could not be sent
  std::string last_publish_error;  ///< why the last one could not, empty if none
  std::int64_t num_received = 0;
  std::int64_t num_rejected = 0;  ///< messages on a wanted channel refused by the codec
  std::string last_rejection;     ///< why the last one was, empty if none
  std::int64_t num_replayed = 0;  ///< signed messages that have come before
  std::string key_file_error;     ///< why a key file that has changed is not used, empty if it is
  std::int64_t num_foreign = 0;   ///< datagrams past the kernel's filter that are no LCM message
  std::int32_t receive_buffer_bytes = 0;  ///< of messages that wait to be read
};

/// Publishes and receives messages on one LCM URL. Single thread, the loop's.
class Bus {
 public:
  virtual ~Bus() = default;
  /// Encodes and sends on the message's channel. A message that cannot be sent (no network) or
  /// that a receiver would refuse (too large, past a limit, not finite) is counted, with the reason
  /// in the statistics: the protocol survives loss.
  virtual void publish(const protocol::Message& message) = 0;
  virtual BusStatistics statistics() const = 0;
  /// What to fill a message to: one Ethernet frame where datagrams cross hosts, since paths lose
  /// fragments one by one, or all. There a larger message is not sent.
  virtual std::size_t batch_bytes_max() const = 0;
  /// What a roll-out batch takes more for each worker that it names: 0 without keys.
  virtual std::size_t word_bytes() const = 0;
};

struct BusOptions {
  std::string url;                ///< resolve_url()
  std::vector<Channel> channels;  ///< to receive
  /// Called in the loop for each message that passed every check, one's own included. Must not
  /// throw, nor destroy the bus.
  std::function<void(protocol::Message)> on_message;
  /// Called right before it with the bytes, by which a signature can be looked at. May be null.
  std::function<void(Channel, std::span<const std::byte>)> on_bytes = nullptr;
  /// Refuses a URL by which no other program is reached: memq, file.
  bool among_programs = false;
  /// What is said is signed, and what is not signed is refused. The file is looked at again now and
  /// then.
  std::optional<KeyFile> key_file = std::nullopt;
  /// With keys: see Authenticator.
  bool only_watches = false;
};

/// The URL to use: the option if given, else LCM_DEFAULT_URL, else LCM's default (ttl 0).
std::string resolve_url(const std::string& option);
/// The same of a daemon. Throws ConfigError, naming the option or the variable, where it cannot be
/// read or reaches no other program. What is only not there yet, a server or a route, is found by
/// open_bus(): a daemon that is started again may have it then.
std::string daemon_url(const char* option, const std::string& text);

/// Fails with one line for a person: a URL that cannot be read (what and where), no multicast
/// route (with the command that adds one), an address in use, no tcpq server. The loop must outlive
/// the bus. Fork before: liblcm does not survive it.
Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options);

}  // namespace treeroll::transport
