#include "common/transport/tcpq_probe.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

namespace treeroll::transport {
namespace {

constexpr int kWaitMs = 1000;
// First words of the protocol; a protocol version follows each.
constexpr std::uint32_t kClientMagic = 0x287617fb;
constexpr std::uint32_t kServerMagic = 0x287617fa;
constexpr std::uint32_t kVersion = 0x0100;

/// Empty if `events` came in time.
std::optional<std::string> wait_for(int descriptor, short events) {
  pollfd waiting{descriptor, events, 0};
  const int count = poll(&waiting, 1, kWaitMs);
  if (count > 0) return std::nullopt;
  return count == 0 ? "no answer within a second" : std::strerror(errno);
}

std::optional<std::string> shake_hands(int descriptor, const sockaddr_in& address) {
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno != EINPROGRESS) return std::strerror(errno);
    if (auto problem = wait_for(descriptor, POLLOUT)) return problem;
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return std::strerror(error);
  }
  const std::array hello = {htonl(kClientMagic), htonl(kVersion)};
  if (send(descriptor, hello.data(), sizeof hello, MSG_NOSIGNAL) != sizeof hello) {
    return std::strerror(errno);
  }
  if (auto problem = wait_for(descriptor, POLLIN)) return problem;
  std::uint32_t answer = 0;
  if (recv(descriptor, &answer, sizeof answer, 0) != sizeof answer ||
      ntohl(answer) != kServerMagic) {
    return "what listens there does not speak LCM's tcpq";
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> tcpq_problem(const LcmUrl& url) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return std::strerror(errno);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(url.port);
  inet_pton(AF_INET, url.host.c_str(), &address.sin_addr);
  auto problem = shake_hands(descriptor, address);
  close(descriptor);
  if (!problem) return std::nullopt;
  return fmt::format("no tcpq server at {}:{}: {}", url.host, url.port, *problem);
}

}  // namespace treeroll::transport
