#include "common/numbers/between.h"

#include <algorithm>

namespace treeroll {

Between between(std::span<const double> places, double x) {
  const double there = std::clamp(x, places.front(), places.back());
  const auto found = std::upper_bound(places.begin() + 1, places.end() - 1, there);
  const auto after = static_cast<std::size_t>(found - places.begin());
  return {after, (there - places[after - 1]) / (places[after] - places[after - 1])};
}

}  // namespace treeroll
