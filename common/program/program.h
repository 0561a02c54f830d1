#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/program/command_line.h"

namespace treeroll {

inline constexpr int kExitDone = 0;
inline constexpr int kExitOther = 1;  ///< anything that is none of the others
inline constexpr int kExitBadInput = 2;

/// A program on the command line: what its main() consists of.
struct Program {
  std::string name;     ///< "treeroll-learner"
  std::string purpose;  ///< the first sentence of --help
  /// The name in each line of the log, with date and process: for daemons that share a terminal.
  /// Empty: the time of day alone.
  std::string log_name = {};
  std::vector<UsageExample> examples = {};  ///< of its use, for --help
  /// Names the options and where their values go.
  std::function<void(CommandLine&)> options;
  /// Does the work once they are read.
  std::function<int()> work;
};

/// Of all programs of this build: "0.2.0".
std::string program_version();

/// Settles the process (process_start.h), logs to standard error, reads the options and works.
/// @return  the exit status: that of `work`; 0 after --help and --version; 2 if the command line is
///          wrong or `work` throws BadInput; 1 if it throws anything else. Errors are logged.
int run_main(int argc, char** argv, const Program& program);

}  // namespace treeroll
