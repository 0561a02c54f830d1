#include "common/transport/multicast_receiver.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "common/protocol/limits.h"
#include "common/transport/short_frame.h"

namespace treeroll::transport {
namespace {

constexpr std::size_t kDatagramBytesMax = 65536;
/// Datagrams fetched in one system call.
constexpr std::size_t kBatch = 16;
constexpr int kBatchesPerTurn = protocol::kDatagramsPerTurnMax / static_cast<int>(kBatch);

/// Closes on every way out of open().
class Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int get() const { return descriptor_; }
  int release() { return std::exchange(descriptor_, -1); }

 private:
  int descriptor_;
};

Error failure(const LcmUrl& url, const std::string& what) {
  return Error{fmt::format("LCM URL \"{}\": {}: {}", url.text, what, std::strerror(errno))};
}

sockaddr_in address_of(const LcmUrl& url) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(url.port);
  inet_pton(AF_INET, url.host.c_str(), &address.sin_addr);
  return address;
}

template <class T>
bool set_option(const Socket& socket, int level, int name, const T& value) {
  return setsockopt(socket.get(), level, name, &value, sizeof value) == 0;
}

/// Empty if all went well.
std::optional<Error> attach_filter(const Socket& socket, const LcmUrl& url,
                                   std::span<const Channel> channels) {
  std::vector<sock_filter> program = short_frame_filter(channels);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  if (set_option(socket, SOL_SOCKET, SO_ATTACH_FILTER, filter)) return std::nullopt;
  return failure(url, "the kernel refuses the socket filter");
}

std::optional<Error> join_group(const Socket& socket, const LcmUrl& url) {
  const int on = 1;
  const int off = 0;
  // Others on this host receive the same group: SO_REUSEADDR, as liblcm.
  if (!set_option(socket, SOL_SOCKET, SO_REUSEADDR, on)) return failure(url, "SO_REUSEADDR");
  if (!set_option(socket, IPPROTO_IP, IP_MULTICAST_ALL, off)) {
    return failure(url, "IP_MULTICAST_ALL");
  }
  if (!set_option(socket, SOL_SOCKET, SO_RCVBUF, url.receive_buffer_bytes)) {
    return failure(url, "recv_buf_size");
  }
  const sockaddr_in address = address_of(url);
  if (bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failure(url, fmt::format("cannot listen on {}:{}", url.host, url.port));
  }
  const ip_mreq membership{address.sin_addr, {htonl(INADDR_ANY)}};
  if (!set_option(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership)) {
    return failure(url, fmt::format("cannot join the group {}", url.host));
  }
  return std::nullopt;
}

}  // namespace

Result<bool> probe_multicast_route(const LcmUrl& url) {
  const Socket socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (socket.get() < 0) return failure(url, "no UDP socket");
  const sockaddr_in address = address_of(url);
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return true;
  }
  if (errno != ENETUNREACH) return failure(url, fmt::format("cannot reach {}", url.host));
  const char* cure =
      url.ttl == 0
          ? "messages stay on this host (ttl=0), so `sudo ip link set lo up multicast on && sudo "
            "ip route add 224.0.0.0/4 dev lo` mends it"
          : "`sudo ip route add 224.0.0.0/4 dev INTERFACE` mends it, with the interface that leads "
            "to the other hosts, on each host";
  return Error{
      fmt::format("LCM URL \"{}\": no multicast route to {}: {}", url.text, url.host, cure)};
}

Result<std::unique_ptr<MulticastReceiver>> MulticastReceiver::open(Loop& loop, const LcmUrl& url,
                                                                   std::vector<Channel> channels,
                                                                   OnMessage on_message) {
  Socket socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.get() < 0) return failure(url, "no UDP socket");
  // Before bind(), so that nothing unwanted is queued in between.
  if (auto error = attach_filter(socket, url, channels)) return *error;
  if (auto error = join_group(socket, url)) return *error;
  int granted = 0;
  socklen_t size = sizeof granted;
  if (getsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &granted, &size) != 0) {
    return failure(url, "SO_RCVBUF");
  }
  std::unique_ptr<MulticastReceiver> receiver(
      new MulticastReceiver(loop, socket.release(), std::move(channels), std::move(on_message)));
  receiver->receive_buffer_bytes_ = granted / 2;
  return receiver;
}

MulticastReceiver::MulticastReceiver(Loop& loop, int descriptor, std::vector<Channel> channels,
                                     OnMessage on_message)
    : loop_(loop),
      descriptor_(descriptor),
      channels_(std::move(channels)),
      on_message_(std::move(on_message)),
      buffer_(kBatch * kDatagramBytesMax) {
  loop_.watch(descriptor_, [this] { drain(); });
}

MulticastReceiver::~MulticastReceiver() {
  loop_.forget(descriptor_);
  close(descriptor_);
}

void MulticastReceiver::drain() {
  std::array<iovec, kBatch> pieces;
  std::array<mmsghdr, kBatch> headers{};
  for (std::size_t i = 0; i < kBatch; ++i) {
    pieces[i] = {buffer_.data() + i * kDatagramBytesMax, kDatagramBytesMax};
    headers[i].msg_hdr.msg_iov = &pieces[i];
    headers[i].msg_hdr.msg_iovlen = 1;
  }
  for (int turn = 0; turn < kBatchesPerTurn; ++turn) {
    // Errors here are pending ICMP errors and the like: taken off the socket by being read.
    const int count = recvmmsg(descriptor_, headers.data(), kBatch, 0, nullptr);
    if (count <= 0) return;
    for (int i = 0; i < count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      take({buffer_.data() + at * kDatagramBytesMax, headers[at].msg_len});
    }
    if (count < static_cast<int>(kBatch)) return;
  }
}

void MulticastReceiver::take(std::span<const std::byte> datagram) {
  const auto frame = read_short_frame(datagram);
  if (frame) {
    for (const Channel channel : channels_) {
      if (frame->channel == channel_name(channel)) {
        on_message_(channel, frame->payload);
        return;
      }
    }
  }
  ++num_foreign_;
}

}  // namespace treeroll::transport
