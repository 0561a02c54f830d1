#include "common/policy/linear/recorded_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace treeroll {

RecordedCurve::RecordedCurve(std::vector<double> inputs, Eigen::MatrixXd outputs)
    : inputs_(std::move(inputs)), outputs_(std::move(outputs)) {
  if (inputs_.size() < 2 || outputs_.cols() != static_cast<Eigen::Index>(inputs_.size())) {
    throw std::invalid_argument("a recording has two samples at least, an output for each input");
  }
  for (std::size_t n = 1; n < inputs_.size(); ++n) {
    if (inputs_[n] > inputs_[n - 1]) continue;
    throw std::invalid_argument(
        fmt::format("input {} of the recording, {}, is not above the one before, {}", n + 1,
                    inputs_[n], inputs_[n - 1]));
  }
  if (!std::isfinite(inputs_.front()) || !std::isfinite(inputs_.back()) || !outputs_.allFinite()) {
    throw std::invalid_argument("a recording must be finite");
  }
}

void RecordedCurve::at(double input, std::span<double> into) const {
  const double x = std::clamp(input, inputs_.front(), inputs_.back());
  const auto after = std::upper_bound(inputs_.begin() + 1, inputs_.end() - 1, x);
  const auto n = static_cast<std::size_t>(after - inputs_.begin());
  const double share = (x - inputs_[n - 1]) / (inputs_[n] - inputs_[n - 1]);
  const auto column = static_cast<Eigen::Index>(n);
  for (std::size_t o = 0; o < into.size(); ++o) {
    const auto row = static_cast<Eigen::Index>(o);
    into[o] = (1 - share) * outputs_(row, column - 1) + share * outputs_(row, column);
  }
}

}  // namespace treeroll
