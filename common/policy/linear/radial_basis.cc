#include "common/policy/linear/radial_basis.h"

#include <algorithm>
#include <cstddef>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll {

RadialBasis::RadialBasis(int size, double low, double high) : width_((high - low) / (size - 1)) {
  CHECK(size >= 2 && low < high, "no such radial functions");
  for (int i = 0; i < size; ++i) centres_.push_back(low + (high - low) * i / (size - 1));
  centres_.back() = high;
}

int RadialBasis::values(double input, std::span<double> values) const {
  // Within the range some centre is at most half a width away: the sum is never 0.
  const double x = std::clamp(input, low(), high());
  double sum = 0;
  for (std::size_t i = 0; i < centres_.size(); ++i) {
    const double distance = (x - centres_[i]) / width_;
    values[i] = elementary::exp(-.5 * distance * distance);
    sum += values[i];
  }
  for (std::size_t i = 0; i < centres_.size(); ++i) values[i] /= sum;
  return 0;
}

}  // namespace treeroll
