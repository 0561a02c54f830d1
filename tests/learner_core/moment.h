#pragma once

#include <chrono>

#include "common/base/time.h"

namespace treeroll::learner {

/// So many milliseconds after the test's beginning.
inline TimePoint at(int ms) { return TimePoint(std::chrono::milliseconds(ms)); }

}  // namespace treeroll::learner
