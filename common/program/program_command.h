#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace treeroll {

/// A file with the right to be executed, no folder. What it holds may still be no program.
bool can_be_executed(const std::filesystem::path& file);

/// A user's program and its arguments from the text of a command, "python3 my_task.py --fast":
/// words as a shell has them, with its quotes, ~ and $VARIABLES, and nothing that a shell would
/// carry out. Throws ConfigError, with the option as its key, for what is no such command and for a
/// program that cannot be executed.
std::vector<std::string> read_program_command(const std::string& option, const std::string& text);

}  // namespace treeroll
