#include "common/program/process_start.h"

#include <fcntl.h>
#include <sys/wait.h>
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

/// Until the child ends. What is passed on is in `heard`, and SIGCHLD.
[[noreturn]] void stand_before(pid_t child, const sigset_t& heard) {
  for (;;) {
    siginfo_t told{};
    const int signal = sigwaitinfo(&heard, &told);
    // A key of the terminal tells the child too, which would take the second for haste; of the
    // terminal's end it tells the first process alone.
    const bool is_known = told.si_code == SI_KERNEL && signal != SIGHUP;
    const bool is_news = signal > 0 && signal != SIGCHLD && !is_known;
    if (is_news) kill(child, signal);
    int status = 0;
    for (pid_t ended = 0; (ended = waitpid(-1, &status, WNOHANG)) > 0;) {
      if (ended != child) continue;
      constexpr int kEndedBySignal = 128;
      _exit(WIFEXITED(status) ? WEXITSTATUS(status) : kEndedBySignal + WTERMSIG(status));
    }
  }
}

void leave_first_place() {
  sigset_t heard;
  sigset_t before;
  sigemptyset(&heard);
  for (const int signal : kStopSignals) sigaddset(&heard, signal);
  for (const int signal : {SIGCHLD, SIGQUIT, SIGUSR1, SIGUSR2}) sigaddset(&heard, signal);
  sigprocmask(SIG_BLOCK, &heard, &before);
  const pid_t child = fork();
  CHECK(child >= 0, "the first process cannot fork");
  if (child > 0) stand_before(child, heard);
  sigprocmask(SIG_SETMASK, &before, nullptr);
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
  if (getpid() == 1) leave_first_place();
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
