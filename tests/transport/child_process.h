#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace treeroll::transport {

/// A program beside the test, ended with it.
class ChildProcess {
 public:
  /// @param command  path and arguments; its output goes nowhere
  explicit ChildProcess(const std::vector<std::string>& command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool is_running();

 private:
  pid_t pid_;
};

/// Listens on a TCP port of this host and never says a word.
class SilentServer {
 public:
  SilentServer();
  ~SilentServer();
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;
  int port() const { return port_; }

 private:
  int descriptor_;
  int port_ = 0;
};

/// A TCP port of this host nobody listens on.
int free_tcp_port();

}  // namespace treeroll::transport
