#pragma once

#include <cstddef>
#include <string>

/// What --describe-task and --evaluate read: JSON on standard input, from anybody.
namespace treeroll::worker {

/// Settings of a study go to a depth of 32; what follows the nesting later does so by recursion.
inline constexpr int kRequestNestingMax = 64;

/// As much of a text as a complaint about it shows.
std::string shown(const std::string& text);

/// All of standard input. Throws ConfigError about `key` if it is longer than bytes_max.
std::string read_standard_input(const std::string& key, std::size_t bytes_max);

}  // namespace treeroll::worker
