#pragma once

namespace treeroll::worker {

/// Floating point as every program begins with it, for what is called while this exists and for
/// what comes after: round to nearest, denormals kept, nothing trapped. A task, or a library that
/// it is linked with, may set other modes and leave them; the next roll-out would then have other
/// bits in this evaluator than in another.
class StandardFloatingPoint {
 public:
  StandardFloatingPoint();
  ~StandardFloatingPoint();
  StandardFloatingPoint(const StandardFloatingPoint&) = delete;
  StandardFloatingPoint& operator=(const StandardFloatingPoint&) = delete;
};

}  // namespace treeroll::worker
