#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/files/scratch_folder.h"

namespace treeroll::end_to_end {

/// A daemon of the build under test, its outputs in files. Ended (SIGKILL) with this object.
class Daemon {
 public:
  /// @param name     of an executable beside the tests, or a path
  /// @param network  the namespace it runs in (Network::host); -1: this process's
  Daemon(const std::string& name, const std::vector<std::string>& arguments,
         const std::filesystem::path& directory,
         const std::map<std::string, std::string>& environment = {}, int network = -1);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  pid_t pid() const { return pid_; }
  void kill(int signal) const;
  /// Exit status, 128 + signal if ended by one, -1 if it has not ended after `limit`.
  int wait(std::chrono::seconds limit);
  std::string standard_output() const;
  std::string standard_error() const;
  /// Processes it has started and that run now.
  std::vector<pid_t> children() const;

 private:
  pid_t pid_ = -1;
  bool ended_ = false;
  std::filesystem::path output_;
};

std::filesystem::path executable(const std::string& name);
std::string read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, const std::string& text);
/// How often the text has these words.
int count_of(const std::string& text, const std::string& words);

/// What a program that has ended has said.
struct Said {
  int status = -1;
  std::string output;
  std::string errors;
};

/// A fresh directory of the test's own, removed at the end, and a multicast group and port of its
/// own on this host.
class Service {
 public:
  Service();

  const std::filesystem::path& directory() const { return directory_; }
  const std::string& url() const { return url_; }

  /// Writes a study and gives its path.
  std::filesystem::path study(const std::string& text) const;

  /// Runs a program in the directory to its end.
  Said run(const std::string& program, const std::vector<std::string>& arguments) const;

  struct Learnt {
    int status = -1;
    nlohmann::json summary;  ///< of --json
    std::string rollouts_csv;
    std::string runs_csv;
    std::string log;
  };
  /// Runs a learner on the study to its end.
  Learnt learn(const std::filesystem::path& study, std::vector<std::string> arguments) const;
  /// Reads what an ended learner that was started with --json and state directory `name` has left.
  Learnt learnt(Daemon& learner, const std::string& name, std::chrono::seconds limit) const;

 private:
  ScratchFolder scratch_;
  std::filesystem::path directory_ = scratch_.path();
  std::string url_;
};

/// Waits, at most `limit`, until `condition` holds.
bool eventually(std::chrono::seconds limit, const std::function<bool()>& condition);

/// The swing-up in ODE, learnt by a tree and by a flat policy: roll-outs of about 5 ms.
struct SwingUpStudy {
  int seed = 1;
  int repetitions = 2;
  int rollouts = 40;
  int in_flight = 1;
};
std::string text_of(const SwingUpStudy& study);

/// The synthetic task, learnt by a tree and by a flat policy.
struct SyntheticStudy {
  std::string study;  ///< lines of [study]
  std::string task;   ///< lines of [task] beside its name
};
std::string text_of(const SyntheticStudy& study);

/// The task of tests/user_program/reach.py, learnt by a flat policy of one Gaussian.
/// @param lines  of [study]
std::string reach_study(const std::string& lines);

}  // namespace treeroll::end_to_end
