#include "tests/transport/stalling_tcpq_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/check.h"

namespace treeroll::transport {

StallingTcpqServer::StallingTcpqServer() {
  descriptor_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  CHECK(bind(descriptor_, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
            listen(descriptor_, 8) == 0 &&
            getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size) == 0,
        "a port of this host");
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { serve(); });
}

StallingTcpqServer::~StallingTcpqServer() {
  shutdown(descriptor_, SHUT_RDWR);  // ends accept()
  thread_.join();
  close(descriptor_);
}

void StallingTcpqServer::serve() {
  constexpr std::uint32_t kServerMagic = 0x287617fa;
  constexpr std::uint32_t kVersion = 0x0100;
  constexpr std::uint32_t kPublish = 1;
  constexpr std::uint32_t kChannelBytes = 17;
  const std::array<std::uint32_t, 4> words = {htonl(kServerMagic), htonl(kVersion), htonl(kPublish),
                                              htonl(kChannelBytes)};
  std::vector<int> connections;
  for (;;) {
    const int connection = accept4(descriptor_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) break;
    send(connection, words.data(), sizeof words, MSG_NOSIGNAL);
    connections.push_back(connection);
    ++num_connections_;
  }
  for (const int connection : connections) close(connection);
}

}  // namespace treeroll::transport
