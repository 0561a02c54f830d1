#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"

namespace treeroll::transport {

class Loop;

/// One per message type; the channel names are in lcmtypes/README.md and channel_name().
enum class Channel {
  kRolloutBatch,
  kRewardBatch,
  kWorkerStatus,
  kTaskDefinition,
  kPolicyDefinition,
  kDefinitionRequest,
  kDefinitionReport,
  kLearnerStatus,
  kRunStatus,
  kBestPolicy,
};
const char* channel_name(Channel channel);

/// What the bus has seen; all counts since it was opened.
struct BusStatistics {
  std::int64_t num_published = 0;
  std::int64_t num_received = 0;
  std::int64_t num_rejected = 0;  ///< datagrams refused by the codec
  std::string last_rejection;     ///< why the last one was, empty if none
  std::int32_t receive_buffer_bytes = 0;
};

/// Publishes and receives messages on one LCM URL. Single thread, the loop's.
class Bus {
 public:
  virtual ~Bus() = default;
  /// Encodes and sends on the message's channel. A message that cannot be sent (too large, no
  /// network) is counted and logged once a kind, not thrown: the protocol survives loss.
  virtual void publish(const protocol::Message& message) = 0;
  virtual BusStatistics statistics() const = 0;
  /// True when messages leave this host (udpm with ttl > 0, or another provider).
  virtual bool crosses_hosts() const = 0;
};

struct BusOptions {
  std::string url;                ///< resolve_url()
  std::vector<Channel> channels;  ///< to receive
  /// Called in the loop for each message that passed every check. Must not throw.
  std::function<void(const protocol::Message&)> on_message;
};

/// The URL to use: the option if given, else LCM_DEFAULT_URL, else LCM's default (ttl 0).
std::string resolve_url(const std::string& option);

/// Fails with one line for a person: a URL that cannot be read (what and where), no multicast
/// route (with the command that adds one), an address in use, no tcpq server.
Result<std::unique_ptr<Bus>> open_bus(Loop& loop, BusOptions options);

}  // namespace treeroll::transport
