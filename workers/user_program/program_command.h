#pragma once

#include <string>
#include <vector>

namespace treeroll::worker {

/// A user's program and its arguments from the text of a command, "python3 my_task.py --fast":
/// words as a shell has them, with its quotes, ~ and $VARIABLES, and nothing that a shell would
/// carry out. Throws ConfigError, with the option as its key, for what is no such command and for a
/// program that cannot be executed.
std::vector<std::string> read_program_command(const std::string& option, const std::string& text);

}  // namespace treeroll::worker
