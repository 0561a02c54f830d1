#include "tests/transport/child_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "common/base/check.h"

namespace treeroll::transport {

ChildProcess::ChildProcess(const std::vector<std::string>& command) : pid_(-1) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_ = fork();
  CHECK(pid_ >= 0, "no process");
  if (pid_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int nowhere = open("/dev/null", O_RDWR);
  for (int i = 0; i < 3; ++i) dup2(nowhere, i);
  execv(arguments[0], arguments.data());
  _exit(127);
}

ChildProcess::~ChildProcess() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

bool ChildProcess::is_running() {
  siginfo_t state{};
  return waitid(P_PID, static_cast<id_t>(pid_), &state, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         state.si_pid == 0;
}

SilentServer::SilentServer() : descriptor_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  CHECK(bind(descriptor_, reinterpret_cast<sockaddr*>(&address), size) == 0, "no port");
  CHECK(listen(descriptor_, 4) == 0, "no listening");
  CHECK(getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size) == 0, "no name");
  port_ = ntohs(address.sin_port);
}

SilentServer::~SilentServer() { close(descriptor_); }

int free_tcp_port() { return SilentServer().port(); }

}  // namespace treeroll::transport
