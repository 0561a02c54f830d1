#include "common/policy/linear/recorded_curve.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/numbers/between.h"

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
  const auto [after, share] = between(inputs_, input);
  const auto column = static_cast<Eigen::Index>(after);
  for (std::size_t o = 0; o < into.size(); ++o) {
    const auto row = static_cast<Eigen::Index>(o);
    into[o] = (1 - share) * outputs_(row, column - 1) + share * outputs_(row, column);
  }
}

}  // namespace treeroll
