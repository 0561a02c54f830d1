#pragma once

#include <cstddef>
#include <span>

namespace treeroll {

/// Where x is among places that rise: `share` of the way from places[after - 1] to places[after],
/// 0 or 1 exactly where it is at one of them or beyond the ends. So (1 - share) a + share b is what
/// lies between two finite values, and one of them to the bit at its place.
struct Between {
  std::size_t after;
  double share;
};

/// Precondition: at least 2 places, each above the one before.
Between between(std::span<const double> places, double x);

}  // namespace treeroll
