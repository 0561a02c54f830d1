#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/base/time.h"
#include "workers/user_program/program_process.h"

namespace treeroll::worker {

/// How a child process ended, as waitpid says.
struct ChildEnd {
  bool exited = false;  ///< else by a signal
  int code = 0;         ///< exit status or signal
};

/// From end() to kill() of an evaluator with a program, whose own grace is within it.
inline constexpr Duration kEvaluatorEndGrace = kProgramEndGrace + std::chrono::seconds(1);

/// What all evaluators of a worker are.
struct EvaluatorSettings {
  std::string program;    ///< command of the user's program that evaluates; empty: our own tasks do
  int memory_mb_max = 0;  ///< of data a process may hold; 0: no limit of ours
  int num_evaluators = 1;
};

/// An evaluator as its daemon sees it: a process of this very executable and a socket to it. Ends
/// the process when destroyed.
class EvaluatorProcess {
 public:
  /// Starts /proc/self/exe with `--evaluator-socket`, and as the settings say. All other
  /// descriptors of the daemon are close-on-exec, signals as a fresh program has them. One that
  /// runs a user's program has a process group of its own, which ends with it.
  static Result<EvaluatorProcess> start(const EvaluatorSettings& settings);

  EvaluatorProcess(EvaluatorProcess&& other) noexcept;
  EvaluatorProcess& operator=(EvaluatorProcess&& other) noexcept;
  ~EvaluatorProcess();

  int socket() const { return socket_; }
  pid_t pid() const { return pid_; }

  /// Has it end its program, which is given a grace for that (kProgramEndGrace), and then itself.
  /// SIGKILL where there is no program. It has to be collected still.
  void end() const;
  /// SIGKILL; the same.
  void kill() const;
  bool has_ended() const;
  /// How it ended, if it has; after that it is not to be killed or asked.
  std::optional<ChildEnd> collect();

  /// From now on cpu_time() counts from 0.
  void restart_cpu_time();
  /// CPU time of the process, all threads, and of a user's program and what that has started; 0 if
  /// that cannot be read.
  Duration cpu_time() const;

 private:
  EvaluatorProcess(pid_t pid, int socket, bool has_program)
      : pid_(pid), socket_(socket), has_program_(has_program) {}
  Duration total_cpu_time() const;

  pid_t pid_ = -1;  // -1: collected or moved from
  int socket_ = -1;
  bool has_program_ = false;
  Duration cpu_time_before_{};
};

}  // namespace treeroll::worker
