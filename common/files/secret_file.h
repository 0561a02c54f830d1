#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace treeroll {

/// Every byte of a regular file that nobody but its owner can read, and whose owner is this user or
/// root. What is looked at is what is read: no other file can take its place in between. Throws
/// std::runtime_error with path and rule.
std::string read_secret_file(const std::filesystem::path& path, std::size_t bytes_max);

}  // namespace treeroll
