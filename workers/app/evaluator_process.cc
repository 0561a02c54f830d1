#include "workers/app/evaluator_process.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>

namespace treeroll::worker {
namespace {

/// The evaluator's end of the socket in its own table of descriptors.
constexpr int kEvaluatorSocket = 3;
/// A definition or a roll-out of the largest size must fit while nobody reads.
constexpr int kSocketBytes = 256 * 1024;

/// Frees what posix_spawn was given, on every way out.
struct SpawnOptions {
  SpawnOptions() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnOptions() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnOptions(const SpawnOptions&) = delete;
  SpawnOptions& operator=(const SpawnOptions&) = delete;

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

Error failure(const char* what, int number) {
  return {std::string("cannot start an evaluator: ") + what + ": " + std::strerror(number)};
}

int spawn(int socket, pid_t& pid) {
  SpawnOptions options;
  // dup2 clears close-on-exec, even onto itself.
  posix_spawn_file_actions_adddup2(&options.actions, socket, kEvaluatorSocket);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&options.attributes, &none);
  posix_spawnattr_setsigdefault(&options.attributes, &all);
  posix_spawnattr_setflags(&options.attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::string program = "treeroll-worker";
  std::string evaluator = "--evaluator=" + std::to_string(kEvaluatorSocket);
  std::string parent = "--parent=" + std::to_string(getpid());
  const std::array<char*, 4> arguments{program.data(), evaluator.data(), parent.data(), nullptr};
  return posix_spawn(&pid, "/proc/self/exe", &options.actions, &options.attributes,
                     arguments.data(), environ);
}

}  // namespace

Result<EvaluatorProcess> EvaluatorProcess::start() {
  std::array<int, 2> sockets{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0) {
    return failure("socketpair", errno);
  }
  for (const int socket : sockets) {
    setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSocketBytes, sizeof kSocketBytes);
  }
  pid_t pid = -1;
  const int error = spawn(sockets[1], pid);
  close(sockets[1]);
  if (error != 0) {
    close(sockets[0]);
    return failure("posix_spawn", error);
  }
  EvaluatorProcess process(pid, sockets[0]);
  if (clock_getcpuclockid(pid, &process.clock_) != 0) return failure("its clock", ESRCH);
  return process;
}

EvaluatorProcess::EvaluatorProcess(EvaluatorProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      socket_(std::exchange(other.socket_, -1)),
      clock_(other.clock_),
      cpu_time_before_(other.cpu_time_before_) {}

EvaluatorProcess& EvaluatorProcess::operator=(EvaluatorProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(socket_, other.socket_);
  std::swap(clock_, other.clock_);
  std::swap(cpu_time_before_, other.cpu_time_before_);
  return *this;
}

EvaluatorProcess::~EvaluatorProcess() {
  if (socket_ >= 0) close(socket_);
  if (pid_ < 0) return;
  kill();
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void EvaluatorProcess::kill() const {
  if (pid_ > 0) ::kill(pid_, SIGKILL);
}

std::optional<ChildEnd> EvaluatorProcess::collect() {
  int status = 0;
  if (pid_ < 0 || waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  pid_ = -1;
  if (WIFEXITED(status)) return ChildEnd{true, WEXITSTATUS(status)};
  return ChildEnd{false, WTERMSIG(status)};
}

void EvaluatorProcess::restart_cpu_time() { cpu_time_before_ = total_cpu_time(); }

Duration EvaluatorProcess::cpu_time() const {
  return std::max(total_cpu_time() - cpu_time_before_, Duration{});
}

Duration EvaluatorProcess::total_cpu_time() const {
  timespec time{};
  if (pid_ < 0 || clock_gettime(clock_, &time) != 0) return cpu_time_before_;
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace treeroll::worker
