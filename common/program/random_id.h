#pragma once

#include <cstdint>

namespace treeroll {

/// A random 63-bit number that is not 0: the name of this incarnation of a daemon.
std::int64_t random_id();

}  // namespace treeroll
