#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "workers/user_program/line_reader.h"

namespace treeroll::worker {

/// From the word that it is to end (SIGTERM) to SIGKILL: a driver stops its motors meanwhile.
inline constexpr std::chrono::seconds kProgramEndGrace(2);

/// Whether a child of ours has ended. It is not reaped.
bool has_ended(pid_t child);

/// How a user's program ended.
struct ProgramEnd {
  bool exited = false;  ///< else by a signal
  int code = 0;         ///< exit status or signal
};

/// A user's program as a process: lines in on its standard input, lines out on its standard output
/// and standard error. It ends with this process, however this ends, and with this object.
class ProgramProcess {
 public:
  /// No time is too long.
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  /// Limits of this process (RLIMIT_DATA, say) are the program's too.
  /// Throws BadInput if it cannot be executed, std::runtime_error if the system starts nothing.
  explicit ProgramProcess(const std::vector<std::string>& command);
  ~ProgramProcess();
  ProgramProcess(const ProgramProcess&) = delete;
  ProgramProcess& operator=(const ProgramProcess&) = delete;

  pid_t pid() const { return pid_; }

  /// To be written as the program reads it.
  void send(const std::string& text);
  /// Nothing more will be sent.
  void close_input();

  /// What of its lines comes next.
  struct Heard {
    enum class What {
      kOutput,   ///< a line of standard output
      kError,    ///< a line of standard error
      kTooLong,  ///< a line of standard output of more than `line_bytes_max`
      kEnded,    ///< it has ended, or has closed its standard output and was ended; all is heard
      kAlso,     ///< `also` has come
      kLate,     ///< nothing of that by the deadline
    };
    What what = What::kLate;
    std::string line = {};
  };
  /// A descriptor that is waited for too, and for what (poll); -1: none.
  struct Also {
    int descriptor = -1;
    short events = 0;
  };
  /// Waits for it. What was written to standard error before a line of standard output is told
  /// before it.
  Heard hear(std::size_t line_bytes_max, Deadline deadline, Also also);

  /// Only after kEnded.
  ProgramEnd end() const { return *end_; }
  /// SIGXCPU once it has used so much more processor time, rounded up to seconds.
  void limit_cpu_time(double limit_s) const;
  /// Forgets what it has written to standard output and has not been heard.
  void drop_output() { output_.lines = LineReader(); }
  // One that leads a group of its own, as with an operator, takes along what it has started.
  /// SIGTERM, once: it may act upon it, and to many programs a second one means haste.
  void terminate();
  void kill() const;

 private:
  struct Pipe {
    int descriptor = -1;
    LineReader lines = LineReader();
  };
  std::optional<Heard> next_line(std::size_t line_bytes_max);
  static bool read(Pipe& pipe);
  static void read_all(Pipe& pipe);
  void write();
  void read_the_rest();
  void wait_for_end();

  pid_t pid_ = -1;
  int its_end_ = -1;  ///< a descriptor that can be read once the program has ended
  int input_ = -1;
  Pipe output_;
  Pipe errors_;
  std::string unsent_;
  bool close_when_sent_ = false;
  bool is_asked_to_end_ = false;
  std::optional<ProgramEnd> end_;
};

}  // namespace treeroll::worker
