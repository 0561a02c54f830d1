#include "workers/user_program/program_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "common/base/bad_input.h"

namespace treeroll::worker {
namespace {

using What = ProgramProcess::Heard::What;

/// How long a program that has closed its standard output may take to end by itself.
constexpr std::chrono::milliseconds kEndGrace(500);
/// Of a program that handles SIGTERM, as a shell, Python and Java tell it: the signal was its end.
constexpr int kStatusOfSigterm = 128 + SIGTERM;
/// Standard error is for people: what has no line break is cut. Only an answer must come whole.
constexpr std::size_t kErrorPieceBytesMax = 65'536;

[[noreturn]] void fail(const std::string& what, int number) {
  throw std::runtime_error("cannot start the program: " + what + ": " + std::strerror(number));
}

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("pipe", errno);
  return ends;
}

void close_one(int& descriptor) {
  if (descriptor >= 0) close(descriptor);
  descriptor = -1;
}

/// In the child, between fork and exec: only what may stand there. Writes errno to `report` if the
/// program cannot be executed.
[[noreturn]] void become(char* const* arguments, const std::array<int, 3>& streams, pid_t parent,
                         int report) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  for (int i = 0; i < 3; ++i) dup2(streams[static_cast<std::size_t>(i)], i);
  // Nothing of ours is its business: with the evaluator's socket it could answer the daemon.
  close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  // Signals as a fresh program has them: an evaluator ignores those that a terminal sends.
  for (int signal = 1; signal < NSIG; ++signal) ::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execvp(arguments[0], arguments);
  const int number = errno;
  [[maybe_unused]] const ssize_t told = ::write(report, &number, sizeof number);
  _exit(127);
}

ProgramEnd end_of(int status) {
  if (!WIFEXITED(status)) return {false, WTERMSIG(status)};
  if (WEXITSTATUS(status) == kStatusOfSigterm) return {false, SIGTERM};
  return {true, WEXITSTATUS(status)};
}

void set_non_blocking(int descriptor) {
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
}

}  // namespace

bool has_ended(pid_t child) {
  siginfo_t ended{};
  return waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         ended.si_pid == child;
}

ProgramProcess::ProgramProcess(const std::vector<std::string>& command) {
  std::vector<std::string> words = command;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::array<int, 2> input = make_pipe();
  std::array<int, 2> output = make_pipe();
  std::array<int, 2> errors = make_pipe();
  std::array<int, 2> report = make_pipe();
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    become(arguments.data(), {input[0], output[1], errors[1]}, parent, report[1]);
  }
  const int fork_error = errno;
  for (int* theirs : {&input[0], &output[1], &errors[1], &report[1]}) close_one(*theirs);
  input_ = input[1];
  output_.descriptor = output[0];
  errors_.descriptor = errors[0];
  errors_.lines = LineReader(kErrorPieceBytesMax);
  int exec_error = 0;
  const bool has_failed =
      pid_ > 0 && ::read(report[0], &exec_error, sizeof exec_error) == sizeof exec_error;
  close_one(report[0]);
  if (pid_ < 0 || has_failed) {
    for (int* ours : {&input_, &output_.descriptor, &errors_.descriptor}) close_one(*ours);
    if (pid_ > 0) waitpid(pid_, nullptr, 0);
    if (!has_failed) fail("fork", fork_error);
    // Of a file that can be executed: another one is missing.
    throw BadInput("cannot be started: " + command.front() + ": " + std::strerror(exec_error) +
                   (exec_error == ENOENT ? " (the interpreter that its first line names?)" : ""));
  }
  // A program that does not read is not waited for in a write, and its end is no signal to us.
  std::signal(SIGPIPE, SIG_IGN);
  for (const int ours : {input_, output_.descriptor, errors_.descriptor}) set_non_blocking(ours);
  its_end_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));  // close-on-exec by itself
}

ProgramProcess::~ProgramProcess() {
  for (int* ours : {&input_, &output_.descriptor, &errors_.descriptor, &its_end_}) {
    close_one(*ours);
  }
  if (end_) return;
  kill();
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void ProgramProcess::send(const std::string& text) {
  unsent_ += text;
  write();
}

void ProgramProcess::close_input() {
  close_when_sent_ = true;
  if (unsent_.empty()) close_one(input_);
}

void ProgramProcess::write() {
  while (input_ >= 0 && !unsent_.empty()) {
    const ssize_t size = ::write(input_, unsent_.data(), unsent_.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return;
    if (size < 0) return close_one(input_);  // it has closed it: its end, or its silence, will tell
    unsent_.erase(0, static_cast<std::size_t>(size));
  }
  if (close_when_sent_ && unsent_.empty()) close_one(input_);
}

/// @return  whether there may be more
bool ProgramProcess::read(Pipe& pipe) {
  if (pipe.descriptor < 0) return false;
  std::array<char, 65536> buffer;  // NOLINT: filled by the system
  const ssize_t size = ::read(pipe.descriptor, buffer.data(), buffer.size());
  if (size < 0 && (errno == EINTR || errno == EAGAIN)) return false;
  if (size <= 0) {
    pipe.lines.finish();
    close_one(pipe.descriptor);
    return false;
  }
  pipe.lines.add({buffer.data(), static_cast<std::size_t>(size)});
  return true;
}

/// All that is there, of a program that writes without an end a bounded part.
void ProgramProcess::read_all(Pipe& pipe) {
  constexpr int kReadsMax = 16;
  for (int i = 0; i < kReadsMax && read(pipe); ++i) {
  }
}

std::optional<ProgramProcess::Heard> ProgramProcess::next_line(std::size_t line_bytes_max) {
  if (auto line = errors_.lines.next()) return Heard{What::kError, *std::move(line)};
  if (auto line = output_.lines.next()) {
    if (line->size() > line_bytes_max) return Heard{What::kTooLong};
    return Heard{What::kOutput, *std::move(line)};
  }
  if (output_.lines.num_bytes_unfinished() > line_bytes_max) return Heard{What::kTooLong};
  return std::nullopt;
}

ProgramProcess::Heard ProgramProcess::hear(std::size_t line_bytes_max, Deadline deadline,
                                           Also also) {
  for (;;) {
    if (auto heard = next_line(line_bytes_max)) return *std::move(heard);
    if (end_) return {What::kEnded};
    if (output_.descriptor < 0) {
      wait_for_end();
      read_all(errors_);
      errors_.lines.finish();
      continue;
    }
    int wait_ms = -1;
    if (deadline) {
      using std::chrono::ceil, std::chrono::milliseconds;
      const auto left = ceil<milliseconds>(*deadline - std::chrono::steady_clock::now()).count();
      wait_ms = static_cast<int>(std::clamp<std::int64_t>(left, 0, 1'000'000'000));
    }
    std::array<pollfd, 5> ends{
        pollfd{errors_.descriptor, POLLIN, 0}, pollfd{output_.descriptor, POLLIN, 0},
        pollfd{unsent_.empty() ? -1 : input_, POLLOUT, 0}, pollfd{also.descriptor, also.events, 0},
        pollfd{its_end_, POLLIN, 0}};
    const int num_ready = poll(ends.data(), ends.size(), wait_ms);
    if (num_ready < 0 && errno != EINTR) throw std::runtime_error("cannot wait for the program");
    if (num_ready <= 0) {
      if (num_ready == 0) return {What::kLate};
      continue;
    }
    if (ends[1].revents != 0) read(output_);
    if (ends[4].revents != 0) {
      read_the_rest();
      continue;
    }
    // After standard output: what was written there before a line is told before it.
    if (ends[0].revents != 0 || ends[1].revents != 0) read_all(errors_);
    if (ends[2].revents != 0) write();
    // Also of one that writes without a pause.
    if (ends[3].revents != 0) return {What::kAlso};
  }
}

/// It has ended. What it has started may hold its streams open for long: that is not waited for.
void ProgramProcess::read_the_rest() {
  read_all(output_);
  read_all(errors_);
  output_.lines.finish();
  close_one(output_.descriptor);
}

/// A program that has closed its standard output can answer nothing any more. What is left in a
/// group of its own goes with it, while the group's number cannot be another's yet.
void ProgramProcess::wait_for_end() {
  using std::chrono::milliseconds;
  auto deadline = std::chrono::steady_clock::now() +
                  (is_asked_to_end_ ? milliseconds(kProgramEndGrace) : kEndGrace);
  while (!has_ended(pid_)) {
    if (std::chrono::steady_clock::now() > deadline) {
      is_asked_to_end_ ? kill() : terminate();
      deadline += kProgramEndGrace;
    }
    std::this_thread::sleep_for(milliseconds(1));
  }
  kill();
  int status = 0;
  waitpid(pid_, &status, 0);
  // A signal of ours would be nobody's fault; this end is the program's own.
  if (is_asked_to_end_) status = W_EXITCODE(1, 0);
  end_ = end_of(status);
}

void ProgramProcess::limit_cpu_time(double limit_s) const {
  clockid_t clock = 0;
  timespec used{};
  if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &used) != 0) return;
  const auto seconds =
      static_cast<rlim_t>(std::ceil(static_cast<double>(used.tv_sec) + 1 + limit_s));
  const rlimit cpu{seconds, seconds + 1};
  prlimit(pid_, RLIMIT_CPU, &cpu, nullptr);
}

void ProgramProcess::terminate() {
  if (end_ || std::exchange(is_asked_to_end_, true)) return;
  if (::kill(-pid_, SIGTERM) != 0) ::kill(pid_, SIGTERM);
}

void ProgramProcess::kill() const {
  if (end_) return;
  ::kill(-pid_, SIGKILL);
  ::kill(pid_, SIGKILL);
}

}  // namespace treeroll::worker
