#include "tests/transport/loopback.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/base/check.h"
#include "common/transport/lcm_url.h"

namespace treeroll::transport {

std::string loopback_url(int salt, const std::string& more_options) {
  const int port = 20000 + getpid() % 20000;
  return fmt::format("udpm://239.255.77.{}:{}?ttl=0{}", salt, port, more_options);
}

bool run_until(Loop& loop, const std::function<bool()>& done, Duration limit) {
  const TimePoint end = loop.now() + limit;
  constexpr Duration kLook = std::chrono::milliseconds(1);
  Timer look(loop, [&] {
    if (done() || loop.now() >= end) {
      loop.stop();
    } else {
      look.set(loop.now() + kLook);
    }
  });
  look.set(loop.now());
  loop.run();
  return done();
}

Listener::Listener(Loop& loop, const std::string& url, std::vector<Channel> channels) {
  auto opened = open_bus(loop, {url, std::move(channels), [this](const protocol::Message& message) {
                                  received.push_back(message);
                                }});
  if (!opened) ADD_FAILURE() << opened.error().message;
  bus = *std::move(opened);
}

void send_datagram(const std::string& url, const std::string& datagram) {
  const auto parsed = parse_lcm_url(url);
  CHECK(parsed, "a URL of the test's own");
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_GE(descriptor, 0);
  const unsigned char ttl = 0;
  ASSERT_EQ(setsockopt(descriptor, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl), 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(parsed->port);
  inet_pton(AF_INET, parsed->host.c_str(), &address.sin_addr);
  const auto sent = sendto(descriptor, datagram.data(), datagram.size(), 0,
                           reinterpret_cast<const sockaddr*>(&address), sizeof address);
  close(descriptor);
  ASSERT_EQ(sent, static_cast<ssize_t>(datagram.size()));
}

std::string short_message(const std::string& channel, const std::string& payload) {
  return std::string("LC02\0\0\0\1", 8) + channel + std::string(1, '\0') + payload;
}

}  // namespace treeroll::transport
