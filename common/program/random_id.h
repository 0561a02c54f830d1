#pragma once

#include <cstdint>

namespace treeroll {

/// A random 63-bit number that is not 0: the name of an incarnation of a learner or a worker.
std::int64_t random_id();

}  // namespace treeroll
