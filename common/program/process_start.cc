#include "common/program/process_start.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "common/base/check.h"

namespace treeroll {
namespace {

constexpr std::array kStopSignals{SIGTERM, SIGINT, SIGHUP};

volatile std::sig_atomic_t stopped_status = 0;
const char* volatile stopped_line = "";

void set_handler(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal, &action, nullptr);
}

// Only async-signal-safe calls.
void end_now(int /*signal*/) {
  const char* const line = stopped_line;
  [[maybe_unused]] const ssize_t ignored = write(STDERR_FILENO, line, std::strlen(line));
  _exit(stopped_status);
}

}  // namespace

void settle_process() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number: those below are open by now. Children inherit it.
    CHECK(open("/dev/null", O_RDWR) == descriptor, "/dev/null cannot be opened");
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  set_handler(SIGCHLD, SIG_DFL);
  // Handlers that do nothing rather than SIG_IGN, which a program executed from here would keep.
  for (const int signal : {SIGPIPE, SIGXFSZ}) set_handler(signal, [](int) {});
}

std::vector<int> stop_signals() {
  std::vector<int> signals;
  for (const int signal : kStopSignals) {
    struct sigaction now {};
    sigaction(signal, nullptr, &now);
    if (now.sa_handler != SIG_IGN) signals.push_back(signal);
  }
  return signals;
}

void end_when_stopped(int exit_status, const char* line) {
  stopped_status = exit_status;
  stopped_line = line;
  for (const int signal : stop_signals()) set_handler(signal, end_now);
}

}  // namespace treeroll
