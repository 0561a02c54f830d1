#include "workers/app/floating_point.h"

#include <cfenv>

namespace treeroll::worker {

// On x86 this sets MXCSR too, with its bits for denormals, and the x87's precision.
StandardFloatingPoint::StandardFloatingPoint() { std::fesetenv(FE_DFL_ENV); }
StandardFloatingPoint::~StandardFloatingPoint() { std::fesetenv(FE_DFL_ENV); }

}  // namespace treeroll::worker
