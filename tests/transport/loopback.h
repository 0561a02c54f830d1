#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/transport/bus.h"
#include "common/transport/loop.h"

namespace treeroll::transport {

/// A multicast URL that stays on this host and that no other test uses at the same time: the port
/// comes from the process number, the group from `salt`.
std::string loopback_url(int salt, const std::string& more_options = "");

/// Runs the loop until `done()`, looked at after every event, or the limit. Returns done().
bool run_until(Loop& loop, const std::function<bool()>& done,
               Duration limit = std::chrono::seconds(10));

/// A bus on `channels` that keeps what it receives.
struct Listener {
  Listener(Loop& loop, const std::string& url, std::vector<Channel> channels);

  std::vector<protocol::Message> received;
  std::unique_ptr<Bus> bus;
};

/// Sends one datagram to the group and port of a udpm URL, from a socket of its own.
void send_datagram(const std::string& url, const std::string& datagram);

/// A short message: magic, sequence number, channel, NUL, payload.
std::string short_message(const std::string& channel, const std::string& payload);

}  // namespace treeroll::transport
