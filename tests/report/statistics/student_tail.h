#pragma once

#include <cmath>

namespace treeroll::report {

/// P(T > t) of Student's t with two degrees of freedom: 1/2 - t / (2 sqrt(2 + t^2)).
inline double tail_of_two_degrees(double t) { return .5 - t / (2 * std::sqrt(2 + t * t)); }

}  // namespace treeroll::report
