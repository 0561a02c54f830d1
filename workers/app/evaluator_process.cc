#include "workers/app/evaluator_process.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/program/log.h"
#include "workers/user_program/family_time.h"

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

int spawn(int socket, const EvaluatorSettings& settings, pid_t& pid) {
  SpawnOptions options;
  // dup2 clears close-on-exec, even onto itself.
  posix_spawn_file_actions_adddup2(&options.actions, socket, kEvaluatorSocket);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&options.attributes, &none);
  posix_spawnattr_setsigdefault(&options.attributes, &all);
  posix_spawnattr_setpgroup(&options.attributes, 0);
  const short flags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
  const short group = settings.program.empty() ? 0 : POSIX_SPAWN_SETPGROUP;
  posix_spawnattr_setflags(&options.attributes, static_cast<short>(flags | group));

  std::vector<std::string> words{"treeroll-worker",
                                 "--evaluator-socket=" + std::to_string(kEvaluatorSocket),
                                 "--parent=" + std::to_string(getpid()),
                                 "--memory-limit-mb=" + std::to_string(settings.memory_mb_max),
                                 "--processes=" + std::to_string(settings.num_evaluators)};
  if (!settings.program.empty()) words.push_back("--evaluator=" + settings.program);
  if (logs_as_json()) words.insert(words.end(), {"--log", "json"});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  return posix_spawn(&pid, "/proc/self/exe", &options.actions, &options.attributes,
                     arguments.data(), environ);
}

}  // namespace

Result<EvaluatorProcess> EvaluatorProcess::start(const EvaluatorSettings& settings) {
  std::array<int, 2> sockets{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0) {
    return failure("socketpair", errno);
  }
  for (const int socket : sockets) {
    setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSocketBytes, sizeof kSocketBytes);
  }
  pid_t pid = -1;
  const int error = spawn(sockets[1], settings, pid);
  close(sockets[1]);
  if (error != 0) {
    close(sockets[0]);
    return failure("posix_spawn", error);
  }
  return EvaluatorProcess(pid, sockets[0], !settings.program.empty());
}

EvaluatorProcess::EvaluatorProcess(EvaluatorProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      socket_(std::exchange(other.socket_, -1)),
      has_program_(other.has_program_),
      cpu_time_before_(other.cpu_time_before_) {}

EvaluatorProcess& EvaluatorProcess::operator=(EvaluatorProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(socket_, other.socket_);
  std::swap(has_program_, other.has_program_);
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

/// It sees the end of what it is asked, and its answer would still be heard.
void EvaluatorProcess::end() const {
  if (has_program_) {
    shutdown(socket_, SHUT_WR);
  } else {
    kill();
  }
}

void EvaluatorProcess::kill() const {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  if (has_program_) ::kill(-pid_, SIGKILL);
}

bool EvaluatorProcess::has_ended() const { return pid_ > 0 && worker::has_ended(pid_); }

std::optional<ChildEnd> EvaluatorProcess::collect() {
  int status = 0;
  if (!has_ended()) return std::nullopt;
  // What a program has started goes with it, while the group's number cannot be another's yet.
  if (has_program_) ::kill(-pid_, SIGKILL);
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  pid_ = -1;
  if (WIFEXITED(status)) return ChildEnd{true, WEXITSTATUS(status)};
  return ChildEnd{false, WTERMSIG(status)};
}

void EvaluatorProcess::restart_cpu_time() { cpu_time_before_ = total_cpu_time(); }

Duration EvaluatorProcess::cpu_time() const {
  return std::max(total_cpu_time() - cpu_time_before_, Duration{});
}

Duration EvaluatorProcess::total_cpu_time() const {
  if (pid_ < 0) return cpu_time_before_;
  return has_program_ ? cpu_time_of_family(pid_) : cpu_time_of(pid_).value_or(cpu_time_before_);
}

}  // namespace treeroll::worker
