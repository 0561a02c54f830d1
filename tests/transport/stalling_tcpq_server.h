#pragma once

#include <atomic>
#include <string>
#include <thread>

namespace treeroll::transport {

/// Speaks LCM's tcpq as far as the handshake and the head of a message, whose rest never comes.
class StallingTcpqServer {
 public:
  StallingTcpqServer();
  ~StallingTcpqServer();
  StallingTcpqServer(const StallingTcpqServer&) = delete;
  StallingTcpqServer& operator=(const StallingTcpqServer&) = delete;

  std::string url() const { return "tcpq://127.0.0.1:" + std::to_string(port_); }
  int num_connections() const { return num_connections_; }

 private:
  void serve();

  int descriptor_ = -1;
  int port_ = 0;
  std::atomic<int> num_connections_ = 0;
  std::thread thread_;
};

}  // namespace treeroll::transport
