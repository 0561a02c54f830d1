#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace treeroll {

/// An exit status above this is that of a program ended by a signal: this plus its number.
inline constexpr int kEndedBySignal = 128;

/// What a program that was run to its end has said.
struct ProgramOutput {
  int exit_status = 0;
  double processor_s = 0;  ///< of the program and of those it has waited for
  std::string output;      ///< standard output
};

/// The program of that name that is installed or built beside this one.
std::filesystem::path program_beside_us(const std::string& name);

/// Runs a program, gives it `input` on standard input and waits for its end. Standard error goes
/// where ours goes. Fails if it cannot be started, says more than `output_bytes_max` or takes
/// longer than `limit` (it is killed then).
Result<ProgramOutput> run_program(const std::filesystem::path& program,
                                  const std::vector<std::string>& arguments,
                                  const std::string& input, std::chrono::seconds limit,
                                  std::size_t output_bytes_max = 1'000'000);

/// Starts a program that ends with this process (SIGKILL when it dies, however it dies), in a
/// process group of its own: what a terminal sends to ours (Ctrl-C) is ours to pass on. Call it
/// from the main thread: the kernel ties the signal to the thread.
Result<pid_t> start_child(const std::filesystem::path& program,
                          const std::vector<std::string>& arguments);

/// A child whose output is read while it works. The descriptors are the caller's to close.
struct PipedChild {
  pid_t pid = -1;
  int output = -1;  ///< of a pipe: what it says on standard output, until it ends
  int errors = -1;  ///< of a file without a name: what it says on standard error
};
/// The same as start_child(), of lower priority.
/// @param niceness  nice(2)
Result<PipedChild> start_piped_child(const std::filesystem::path& program,
                                     const std::vector<std::string>& arguments, int niceness);

/// Asks a child to end (SIGTERM), waits up to `grace`. Asks it again then, which to our programs
/// means at once, and kills it where that ends it neither. Reaps it.
void end_child(pid_t child, std::chrono::milliseconds grace);

}  // namespace treeroll
