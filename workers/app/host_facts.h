#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace treeroll::worker {

/// Names what the last bits of a simulation depend on: architecture, the processor features by
/// which the C library chooses its variants, and that library's version.
std::string numeric_class();

/// A random 63-bit number that is not 0, the name of this incarnation.
std::int64_t random_id();

}  // namespace treeroll::worker
