#include <fmt/format.h>

#include <utility>

#include "common/transport/lcm_bus.h"
#include "common/transport/multicast_receiver.h"

namespace treeroll::transport {
namespace {

class UdpmBus final : public LcmBus {
 public:
  UdpmBus(Loop& loop, LcmHandle lcm, LcmUrl url, BusOptions options)
      : LcmBus(loop, std::move(lcm), std::move(url), std::move(options)) {}

  Result<bool> start(Loop& loop) {
    auto receiver = MulticastReceiver::open(
        loop, url_, options_.channels,
        [this](Channel channel, std::span<const std::byte> bytes) { take(channel, bytes); });
    if (!receiver) return receiver.error();
    receiver_ = *std::move(receiver);
    statistics_.receive_buffer_bytes = receiver_->receive_buffer_bytes();
    return true;
  }

  BusStatistics statistics() const override {
    BusStatistics statistics = statistics_;
    statistics.num_foreign = receiver_->num_foreign();
    return statistics;
  }

 private:
  std::unique_ptr<MulticastReceiver> receiver_;
};

}  // namespace

Result<std::unique_ptr<Bus>> open_udpm_bus(Loop& loop, LcmUrl url, BusOptions options) {
  if (const auto route = probe_multicast_route(url); !route) return route.error();
  LcmHandle lcm(lcm_create(url.text.c_str()));
  if (!lcm) return Error{fmt::format("LCM URL \"{}\": liblcm refuses it", url.text)};
  auto bus = std::make_unique<UdpmBus>(loop, std::move(lcm), std::move(url), std::move(options));
  if (const auto started = bus->start(loop); !started) return started.error();
  return std::unique_ptr<Bus>(std::move(bus));
}

}  // namespace treeroll::transport
