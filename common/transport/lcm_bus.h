#pragma once

#include <lcm/lcm.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/transport/authenticator.h"
#include "common/transport/bus.h"
#include "common/transport/lcm_url.h"
#include "common/transport/loop.h"

namespace treeroll::transport {

struct LcmDestroyer {
  void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
};
using LcmHandle = std::unique_ptr<lcm_t, LcmDestroyer>;

/// What all providers share: publishing through liblcm, and taking what was received through the
/// codec. How messages are received is the subclass's part.
class LcmBus : public Bus {
 public:
  void publish(const protocol::Message& message) final;
  BusStatistics statistics() const override { return statistics_; }
  std::size_t batch_bytes_max() const override;
  std::size_t word_bytes() const override;

 protected:
  /// The loop must outlive the bus.
  LcmBus(Loop& loop, LcmHandle lcm, LcmUrl url, BusOptions options);
  /// Hands encoded bytes to liblcm; otherwise why not.
  virtual std::optional<std::string> send(Channel channel, const std::vector<std::byte>& bytes);
  /// Whether datagrams leave this host, where fragments are lost one by one or altogether.
  bool crosses_hosts() const { return url_.provider == Provider::kUdpm && url_.ttl > 0; }
  std::optional<std::string> past_frame(Channel channel, std::size_t num_bytes) const;
  /// Decodes and hands over, or counts the refusal.
  void take(Channel channel, std::span<const std::byte> bytes);

  LcmHandle lcm_;
  LcmUrl url_;
  BusOptions options_;
  BusStatistics statistics_;

 private:
  void reject(std::string why);
  void look_at_keys();

  Loop& keys_loop_;
  std::optional<Authenticator> authenticator_;
  Timer keys_timer_;
};

/// udpm: receives on a MulticastReceiver.
Result<std::unique_ptr<Bus>> open_udpm_bus(Loop& loop, LcmUrl url, BusOptions options);
/// Every other provider: receives through liblcm's descriptor.
Result<std::unique_ptr<Bus>> open_descriptor_bus(Loop& loop, LcmUrl url, BusOptions options);

}  // namespace treeroll::transport
