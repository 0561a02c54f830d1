#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "workers/user_program/evaluator_lines.h"
#include "workers/user_program/program_process.h"

namespace treeroll::worker {

/// How a user's program is to be run.
struct ProgramSettings {
  std::string command;             ///< as it was given, for people
  std::vector<std::string> words;  ///< read_program_command() of it
};

/// The program has ended, or was ended because it had lost step, and nothing it was asked will be
/// answered. No std::exception on purpose: what fails a roll-out is caught as one, and this is the
/// end of the evaluator that runs the program.
struct ProgramEnded {
  ProgramEnd end;
  int rule = 0;      ///< of EVALUATOR.md, that it has broken
  std::string what;  ///< for a person: how it ended, under what, its last words
};

/// One roll-out to be evaluated.
struct ProgramRollout {
  std::int64_t run = 0;
  std::int64_t rollout = 0;
  std::uint64_t seed = 0;
  std::string policy;  ///< text of a policy with the roll-out's theta
};

/// A conversation with a user's program: one question at a time, by the rules of EVALUATOR.md. All
/// but the constructor throw ProgramEnded.
class UserProgram {
 public:
  /// Told each line that is for the log, one that says what the program is at, "run 3, roll-out
  /// 17".
  using Log = std::function<void(const std::string& where, const std::string& line)>;

  /// Starts it. Throws as ProgramProcess does.
  UserProgram(ProgramSettings settings, Log log);
  /// Ends it, with a grace for its motors.
  ~UserProgram();
  UserProgram(const UserProgram&) = delete;
  UserProgram& operator=(const UserProgram&) = delete;

  const ProgramSettings& settings() const { return settings_; }
  ProgramProcess& process() { return process_; }

  /// Asks it to take a task. Throws ConfigError if it refuses, or says what is no description. [9]
  DescribeAnswer describe(const std::string& name, const nlohmann::json& settings);
  /// Has a roll-out evaluated with the task described last.
  EvaluateAnswer evaluate(const ProgramRollout& rollout, const TaskDescription& task, Trace* trace);

  /// From now on an answer that takes longer ends the program. There is no limit of ours before.
  void set_answer_limit(std::chrono::milliseconds limit) { answer_limit_ = limit; }
  /// A line of the caller's own, and what is answered.
  std::string ask_anything(const std::string& line) { return ask(line, kAnswerBytesMax); }

  /// Hears what the program says unasked until the socket of its evaluator can be read. From now on
  /// the program is also ended in the midst of an answer where the other side of that is shut.
  void attend(int socket);
  /// The same for a while.
  void attend_for(std::chrono::milliseconds time);

 private:
  std::string ask(const std::string& line, std::size_t answer_bytes_max);
  /// @return  whether the program said something
  bool hear_unasked(ProgramProcess::Deadline deadline, ProgramProcess::Also also);
  void dismiss();
  void note(std::string_view line);
  [[noreturn]] void throw_ended(const std::string& what);
  [[noreturn]] void end_it(int rule, const std::string& why);

  ProgramSettings settings_;
  Log log_;
  std::string where_ = "at its start";
  std::string last_words_;
  std::optional<std::chrono::milliseconds> answer_limit_;
  int socket_ = -1;  ///< of its evaluator
  ProgramProcess process_;
};

}  // namespace treeroll::worker
