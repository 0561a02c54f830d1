#include <fmt/format.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"
#include "common/transport/lcm_bus.h"

namespace treeroll::transport {
namespace {

/// liblcm keeps 30 messages by default and drops silently.
constexpr int kQueueCapacity = 10000;
/// Messages taken in one go before timers and other descriptors get their turn.
constexpr int kMessagesPerTurn = 256;
constexpr int kReconnectSeconds = 2;

/// tcpq, memq, file: liblcm's descriptor, watched in the loop. A tcpq server that goes away takes
/// the descriptor with it; a timer of the bus asks liblcm to connect again.
class DescriptorBus final : public LcmBus {
 public:
  DescriptorBus(Loop& loop, LcmHandle lcm, LcmUrl url, BusOptions options)
      : LcmBus(std::move(lcm), std::move(url), std::move(options)), loop_(loop) {
    statistics_.receive_buffer_bytes = kReceiveBufferBytesDefault;
  }

  ~DescriptorBus() override {
    if (watched_ >= 0) loop_.forget(watched_);
    if (retry_timer_ >= 0) {
      loop_.forget(retry_timer_);
      close(retry_timer_);
    }
  }

  Result<bool> start() {
    subscriptions_.reserve(options_.channels.size());  // liblcm keeps their addresses
    for (const Channel channel : options_.channels) {
      subscriptions_.push_back({this, channel});
      lcm_subscription_t* subscription =
          lcm_subscribe(lcm_.get(), channel_name(channel), &DescriptorBus::on_lcm_message,
                        &subscriptions_.back());
      CHECK(subscription != nullptr, "liblcm refuses a channel name");
      lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
    }
    if (lcm_get_fileno(lcm_.get()) < 0) {
      return Error{fmt::format("LCM URL \"{}\": no {} at {}:{}", url_.text,
                               "tcpq server (`java -cp lcm.jar lcm.lcm.TCPService PORT`)",
                               url_.host, url_.port)};
    }
    follow_descriptor();
    return true;
  }

  void publish(const protocol::Message& message) override {
    LcmBus::publish(message);
    follow_descriptor();
  }

 private:
  struct Subscription {
    DescriptorBus* bus;
    Channel channel;
  };

  static void on_lcm_message(const lcm_recv_buf_t* received, const char*, void* user) {
    // An exception may not cross liblcm; on_message does not throw, the codec neither.
    const auto* subscription = static_cast<const Subscription*>(user);
    const std::size_t size = received->data_size;
    // liblcm hands over 4294967295 where a datagram lacks the NUL of its channel.
    if (size > protocol::kMessageBytesMax) {
      ++subscription->bus->statistics_.num_foreign;
      return;
    }
    subscription->bus->take(subscription->channel,
                            {static_cast<const std::byte*>(received->data), size});
  }

  void drain() {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const int handled = lcm_handle_timeout(lcm_.get(), 0);
      if (handled > 0) continue;
      if (handled < 0) is_ended_ = url_.provider == Provider::kFile;  // the log has been read
      break;
    }
    follow_descriptor();
  }

  /// Watches what liblcm says its descriptor is now.
  void follow_descriptor() {
    const int descriptor = is_ended_ ? -1 : lcm_get_fileno(lcm_.get());
    if (descriptor == watched_) return;
    if (watched_ >= 0) loop_.forget(watched_);
    watched_ = descriptor;
    if (watched_ >= 0) {
      loop_.watch(watched_, [this] { drain(); });
    } else if (!is_ended_ && retry_timer_ < 0) {
      start_retrying();
    }
  }

  void start_retrying() {
    retry_timer_ = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
    CHECK(retry_timer_ >= 0, "no timerfd");
    const itimerspec period{{kReconnectSeconds, 0}, {kReconnectSeconds, 0}};
    CHECK(timerfd_settime(retry_timer_, 0, &period, nullptr) == 0, "timerfd_settime");
    loop_.watch(retry_timer_, [this] {
      std::uint64_t expirations = 0;
      if (read(retry_timer_, &expirations, sizeof expirations) < 0) return;
      if (watched_ < 0) drain();  // liblcm connects again when it is asked for messages
    });
  }

  Loop& loop_;
  std::vector<Subscription> subscriptions_;
  int watched_ = -1;
  int retry_timer_ = -1;
  bool is_ended_ = false;
};

}  // namespace

Result<std::unique_ptr<Bus>> open_descriptor_bus(Loop& loop, LcmUrl url, BusOptions options) {
  LcmHandle lcm(lcm_create(url.text.c_str()));
  if (!lcm) return Error{fmt::format("LCM URL \"{}\": liblcm cannot open it", url.text)};
  auto bus =
      std::make_unique<DescriptorBus>(loop, std::move(lcm), std::move(url), std::move(options));
  if (const auto started = bus->start(); !started) return started.error();
  return std::unique_ptr<Bus>(std::move(bus));
}

}  // namespace treeroll::transport
