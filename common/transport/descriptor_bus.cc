#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <chrono>
#include <csignal>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"
#include "common/transport/lcm_bus.h"
#include "common/transport/tcpq_probe.h"

namespace treeroll::transport {
namespace {

/// liblcm keeps 30 messages by default and drops silently.
constexpr int kQueueCapacity = 10000;
/// Messages taken in one go before timers and other descriptors get their turn.
constexpr int kMessagesPerTurn = 256;
constexpr Duration kReconnectPeriod = std::chrono::seconds(2);
/// liblcm reads and writes whole messages. A server that stops amid one costs so much, and then
/// the connection, not the daemon.
constexpr timeval kMessageTimeMax{1, 0};

void limit_waiting(int descriptor) {
  for (const int direction : {SO_RCVTIMEO, SO_SNDTIMEO}) {
    CHECK(setsockopt(descriptor, SOL_SOCKET, direction, &kMessageTimeMax, sizeof kMessageTimeMax) ==
              0,
          "a socket's time limit");
  }
}

/// Of a connection to a tcpq server.
void set_flag(int descriptor, int flag, int value) {
  CHECK(setsockopt(descriptor, IPPROTO_TCP, flag, &value, sizeof value) == 0,
        "a flag of a TCP socket");
}

/// tcpq, memq, file: liblcm's descriptor, watched in the loop. A tcpq server that goes away takes
/// the descriptor with it; a timer of the bus connects again.
class DescriptorBus final : public LcmBus {
 public:
  DescriptorBus(Loop& loop, LcmUrl url, BusOptions options)
      : LcmBus(loop, nullptr, std::move(url), std::move(options)), loop_(loop) {
    // Streams and queues drop nothing that a window could prevent.
    statistics_.receive_buffer_bytes = kReceiveBufferBytesDefault;
    subscriptions_.reserve(options_.channels.size());  // liblcm keeps their addresses
    for (const Channel channel : options_.channels) subscriptions_.push_back({this, channel});
  }

  ~DescriptorBus() override {
    if (watched_ >= 0) loop_.forget(watched_);
  }

  /// Empty if the bus is connected, otherwise why not.
  std::optional<std::string> open() {
    if (url_.provider == Provider::kTcpq) {
      std::signal(SIGPIPE, SIG_IGN);  // liblcm writes to a server that has gone
      if (auto problem = tcpq_problem(url_)) return problem;
    }
    lcm_.reset(lcm_create(url_.text.c_str()));
    if (!lcm_) {
      return url_.provider == Provider::kFile
                 ? "liblcm cannot open the log: it must exist and hold an event, or "
                   "mode=w must be given"
                 : "liblcm cannot open it";
    }
    for (Subscription& entry : subscriptions_) {
      lcm_subscription_t* subscription =
          lcm_subscribe(lcm_.get(), channel_name(entry.channel), &on_lcm_message, &entry);
      CHECK(subscription != nullptr, "liblcm refuses a channel name");
      lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
    }
    if (url_.provider == Provider::kTcpq) {
      if (lcm_get_fileno(lcm_.get()) < 0) return "the tcpq server hung up";
      limit_waiting(lcm_get_fileno(lcm_.get()));
      set_flag(lcm_get_fileno(lcm_.get()), TCP_NODELAY, 1);
    }
    follow_descriptor();
    return std::nullopt;
  }

 private:
  struct Subscription {
    DescriptorBus* bus;
    Channel channel;
  };

  static void on_lcm_message(const lcm_recv_buf_t* received, const char*, void* user) {
    // An exception may not cross liblcm; on_message does not throw, nor does the codec.
    const auto* subscription = static_cast<const Subscription*>(user);
    subscription->bus->take(subscription->channel,
                            {static_cast<const std::byte*>(received->data), received->data_size});
  }

  std::optional<std::string> send(Channel channel, const std::vector<std::byte>& bytes) override {
    // Asked to publish without a connection, liblcm would wait for one.
    if (is_lost()) return fmt::format("no connection to {}:{}", url_.host, url_.port);
    if (url_.provider != Provider::kTcpq) return LcmBus::send(channel, bytes);
    // liblcm writes a message in five parts: they leave together, and at once.
    const int before = watched_;
    set_flag(before, TCP_CORK, 1);
    auto problem = LcmBus::send(channel, bytes);
    follow_descriptor();
    if (watched_ == before) set_flag(before, TCP_CORK, 0);
    return problem;
  }

  bool is_lost() const { return url_.provider == Provider::kTcpq && watched_ < 0; }

  void drain() {
    // Not lcm_handle_timeout(): its select() writes past its set for a descriptor of 1024 or more.
    pollfd readable{watched_, POLLIN, 0};
    for (int i = 0; i < kMessagesPerTurn && watched_ >= 0 && poll(&readable, 1, 0) > 0; ++i) {
      acknowledge_at_once();
      if (lcm_handle(lcm_.get()) < 0) has_failed_ = true;
      follow_descriptor();
    }
    acknowledge_at_once();
  }

  /// A server that writes a message in parts, and leaves Nagle's algorithm on, sends none before
  /// the one before is acknowledged, which would wait 40 ms for a message of ours to go along with:
  /// also while liblcm waits for the rest. The kernel forgets it as soon as we send.
  void acknowledge_at_once() {
    if (url_.provider == Provider::kTcpq && watched_ >= 0) set_flag(watched_, TCP_QUICKACK, 1);
  }

  /// Watches what liblcm says its descriptor is now.
  void follow_descriptor() {
    // A log that has been read to its end: liblcm's descriptor stays readable for ever.
    const bool is_ended = has_failed_ && url_.provider != Provider::kTcpq;
    const int descriptor = is_ended ? -1 : lcm_get_fileno(lcm_.get());
    if (descriptor == watched_) return;
    if (watched_ >= 0) loop_.forget(watched_);
    watched_ = descriptor;
    if (watched_ >= 0) loop_.watch(watched_, [this] { drain(); });
    if (is_lost()) retry_.set(loop_.now() + kReconnectPeriod);
  }

  void retry() {
    const auto problem = open();
    if (!problem) return;
    statistics_.last_publish_error = *problem;
    retry_.set(loop_.now() + kReconnectPeriod);
  }

  Loop& loop_;
  std::vector<Subscription> subscriptions_;
  int watched_ = -1;
  Timer retry_{loop_, [this] { retry(); }};
  bool has_failed_ = false;
};

}  // namespace

Result<std::unique_ptr<Bus>> open_descriptor_bus(Loop& loop, LcmUrl url, BusOptions options) {
  const std::string text = url.text;
  auto bus = std::make_unique<DescriptorBus>(loop, std::move(url), std::move(options));
  if (const auto problem = bus->open()) {
    return Error{fmt::format("LCM URL \"{}\": {}", text, *problem)};
  }
  return std::unique_ptr<Bus>(std::move(bus));
}

}  // namespace treeroll::transport
