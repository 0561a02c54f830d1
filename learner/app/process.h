#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace treeroll {

/// What a program that was run to its end has said.
struct ProgramOutput {
  int exit_status = 0;  ///< 128 + signal if it was ended by one
  std::string output;   ///< standard output, at most 1 MB
};

/// Runs a program, gives it `input` on standard input and waits for its end. Standard error goes
/// where ours goes. Fails if it cannot be started, says too much or takes longer than `limit`
/// (it is killed then).
Result<ProgramOutput> run_program(const std::filesystem::path& program,
                                  const std::vector<std::string>& arguments,
                                  const std::string& input, std::chrono::seconds limit);

/// Starts a program that ends with this process (SIGKILL when it dies, however it dies), in a
/// process group of its own: what a terminal sends to ours (Ctrl-C) is ours to pass on. Call it
/// from the main thread: the kernel ties the signal to the thread.
Result<pid_t> start_child(const std::filesystem::path& program,
                          const std::vector<std::string>& arguments);

/// Asks a child to end (SIGTERM), waits up to `grace`, kills it then. Reaps it.
void end_child(pid_t child, std::chrono::milliseconds grace);

}  // namespace treeroll
