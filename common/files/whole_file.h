#pragma once

#include <filesystem>
#include <string>

namespace treeroll {

/// Every byte of a regular file. Throws std::runtime_error with path and reason for anything else,
/// folders and devices included, and for more than 4 GB.
std::string read_whole_file(const std::filesystem::path& path);

}  // namespace treeroll
