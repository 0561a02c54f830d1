#include "learner/worker_program/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <thread>
#include <utility>

namespace treeroll {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kCannotStart = 127;
/// A worker in haste still gives its programs a grace: 3 s.
constexpr std::chrono::milliseconds kHasteGrace(5000);

struct Pipe {
  int read_end = -1;
  int write_end = -1;
  Pipe() = default;
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close_read();
    close_write();
  }
  bool open() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return false;
    read_end = ends[0];
    write_end = ends[1];
    return true;
  }
  void close_read() { close_end(read_end); }
  void close_write() { close_end(write_end); }

 private:
  static void close_end(int& end) {
    if (end >= 0) close(end);
    end = -1;
  }
};

std::vector<char*> argv_of(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  return argv;
}

/// What is not the child's as it is ours; -1: as ours.
struct Streams {
  int input = -1;
  int output = -1;
  int errors = -1;
};

/// Forks and executes; in the child only async-signal-safe calls.
Result<pid_t> launch(const std::string& program, const std::vector<std::string>& arguments,
                     const Streams& streams, int niceness = 0) {
  const std::vector<char*> argv = argv_of(program, arguments);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) return Error{fmt::format("cannot fork: {}", std::strerror(errno))};
  if (child > 0) return child;
  std::signal(SIGPIPE, SIG_DFL);  // ignoring it is our business alone
  if (streams.input < 0) setpgid(0, 0);
  if (niceness != 0) setpriority(PRIO_PROCESS, 0, niceness);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotStart);  // it died before the line above
  if (streams.input >= 0) dup2(streams.input, STDIN_FILENO);
  if (streams.output >= 0) dup2(streams.output, STDOUT_FILENO);
  if (streams.errors >= 0) dup2(streams.errors, STDERR_FILENO);
  close_range(STDERR_FILENO + 1, ~0U, 0);  // sockets of ours are not its business
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execv(argv[0], argv.data());
  _exit(kCannotStart);
}

int status_of(int wait_status) {
  return WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : kEndedBySignal + WTERMSIG(wait_status);
}

/// Feeds input and gathers output until the program closes its output.
Result<std::string> converse(Pipe& to_child, Pipe& from_child, const std::string& input,
                             Clock::time_point deadline, std::size_t output_bytes_max) {
  std::string output;
  std::size_t written = 0;
  fcntl(to_child.write_end, F_SETFL, O_NONBLOCK);
  if (input.empty()) to_child.close_write();
  for (;;) {
    // No longer than an int of milliseconds holds; then it is looked at anew.
    const auto left = std::min<std::int64_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count(),
        std::numeric_limits<int>::max());
    if (left <= 0) return Error{"it takes too long"};
    pollfd ends[2] = {{from_child.read_end, POLLIN, 0}, {to_child.write_end, POLLOUT, 0}};
    if (poll(ends, 2, static_cast<int>(left)) < 0 && errno != EINTR) {
      return Error{fmt::format("poll: {}", std::strerror(errno))};
    }
    if (to_child.write_end >= 0 && (ends[1].revents & (POLLOUT | POLLERR)) != 0) {
      const ssize_t size =
          write(to_child.write_end, input.data() + written, input.size() - written);
      if (size > 0) written += static_cast<std::size_t>(size);
      if ((size < 0 && errno != EAGAIN) || written == input.size()) to_child.close_write();
    }
    if ((ends[0].revents & (POLLIN | POLLHUP)) != 0) {
      char buffer[65536];
      const ssize_t size = read(from_child.read_end, buffer, sizeof buffer);
      if (size == 0) return output;
      if (size > 0) output.append(buffer, static_cast<std::size_t>(size));
      if (output.size() > output_bytes_max) {
        return Error{fmt::format("it says more than {} bytes", output_bytes_max)};
      }
    }
  }
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

struct ChildEnd {
  int wait_status = 0;
  double processor_s = 0;
};

/// Reaps the child if it ends before the deadline.
std::optional<ChildEnd> wait_until(pid_t child, Clock::time_point deadline) {
  for (;;) {
    int wait_status = 0;
    rusage used{};
    if (wait4(child, &wait_status, WNOHANG, &used) == child) {
      return ChildEnd{wait_status, seconds_of(used.ru_utime) + seconds_of(used.ru_stime)};
    }
    if (Clock::now() > deadline) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void kill_and_reap(pid_t child) {
  kill(child, SIGKILL);
  while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace

std::filesystem::path program_beside_us(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

Result<ProgramOutput> run_program(const std::filesystem::path& program,
                                  const std::vector<std::string>& arguments,
                                  const std::string& input, std::chrono::seconds limit,
                                  std::size_t output_bytes_max) {
  Pipe to_child;
  Pipe from_child;
  if (!to_child.open() || !from_child.open()) {
    return Error{fmt::format("cannot make a pipe: {}", std::strerror(errno))};
  }
  Result<pid_t> child =
      launch(program, arguments, {.input = to_child.read_end, .output = from_child.write_end});
  if (!child) return child.error();
  // A program that does not read its input must not end us.
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  to_child.close_read();
  from_child.close_write();
  const Clock::time_point deadline = Clock::now() + limit;
  Result<std::string> output = converse(to_child, from_child, input, deadline, output_bytes_max);
  // It may have closed its output without ending.
  const std::optional<ChildEnd> end = output ? wait_until(*child, deadline) : std::nullopt;
  if (!end) {
    kill_and_reap(*child);
    if (output) output = Error{"it takes too long"};
  }
  std::signal(SIGPIPE, before);
  if (!output) return Error{fmt::format("{}: {}", program.string(), output.error().message)};
  if (status_of(end->wait_status) == kCannotStart) {
    return Error{fmt::format("{}: cannot be executed", program.string())};
  }
  return ProgramOutput{status_of(end->wait_status), end->processor_s, std::move(*output)};
}

Result<pid_t> start_child(const std::filesystem::path& program,
                          const std::vector<std::string>& arguments) {
  return launch(program, arguments, {});
}

Result<PipedChild> start_piped_child(const std::filesystem::path& program,
                                     const std::vector<std::string>& arguments, int niceness) {
  Pipe output;
  const int errors = memfd_create("errors", MFD_CLOEXEC);
  if (errors < 0 || !output.open()) {
    const int error = errno;
    if (errors >= 0) close(errors);
    return Error{fmt::format("cannot make a pipe: {}", std::strerror(error))};
  }
  const Result<pid_t> child =
      launch(program, arguments, {.output = output.write_end, .errors = errors}, niceness);
  if (!child) {
    close(errors);
    return child.error();
  }
  return PipedChild{*child, std::exchange(output.read_end, -1), errors};
}

void end_child(pid_t child, std::chrono::milliseconds grace) {
  for (const std::chrono::milliseconds patience : {grace, kHasteGrace}) {
    kill(child, SIGTERM);
    if (wait_until(child, Clock::now() + patience)) return;
  }
  kill_and_reap(child);
}

}  // namespace treeroll
