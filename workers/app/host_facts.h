#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace treeroll::worker {

/// As learners show it: readable().
std::string host_name();

/// A name that the kernel takes as any bytes, as a message and a table may hold it: what is no
/// visible ASCII character is "?". Learners refuse messages with text that is not UTF-8.
std::string readable(std::string_view name);

/// Names what the last bits of a simulation depend on: architecture, the processor features by
/// which the C library chooses its variants, and that library's version.
std::string numeric_class();

/// A random 63-bit number that is not 0, the name of this incarnation.
std::int64_t random_id();

}  // namespace treeroll::worker
