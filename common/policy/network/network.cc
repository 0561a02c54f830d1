#include "common/policy/network/network.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/numbers/elementary.h"

namespace treeroll {
namespace {

/// Scaled inputs stay finite, however far out: a unit has turned over long before.
constexpr double kScaledMax = 1e6;

double tangent(double x) {
  const double shrunk = elementary::exp(-2 * std::abs(x));
  const double size = (1 - shrunk) / (1 + shrunk);
  return x < 0 ? -size : size;
}

Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

}  // namespace

Eigen::VectorXd Network::numbers() const {
  Eigen::VectorXd all(outer.size() + inner.size());
  all << outer.transpose().reshaped(), inner.transpose().reshaped();
  return all;
}

Network Network::with(const Eigen::VectorXd& numbers) const {
  Network changed = *this;
  changed.outer = numbers.head(outer.size()).reshaped(outer.cols(), outer.rows()).transpose();
  changed.inner = numbers.tail(inner.size()).reshaped(inner.cols(), inner.rows()).transpose();
  return changed;
}

void Network::act(std::span<const double> input, std::span<double> scaled, std::span<double> hidden,
                  std::span<double> output) const {
  for (std::size_t i = 0; i < scaled.size(); ++i) {
    const Range& range = ranges[i];
    const double place = input[i] / (range.high - range.low) - range.low / (range.high - range.low);
    scaled[i] = std::clamp(2 * place - 1, -kScaledMax, kScaledMax);
  }
  for (std::size_t j = 0; j < hidden.size(); ++j) {
    double sum = inner(index(j), inner.cols() - 1);
    for (std::size_t i = 0; i < scaled.size(); ++i) sum += inner(index(j), index(i)) * scaled[i];
    hidden[j] = tangent(sum);
  }
  for (std::size_t o = 0; o < output.size(); ++o) {
    double sum = outer(index(o), outer.cols() - 1);
    for (std::size_t j = 0; j < hidden.size(); ++j) sum += outer(index(o), index(j)) * hidden[j];
    output[o] = sum;
  }
}

void Network::derivative(std::span<const double> scaled, std::span<const double> hidden,
                         Eigen::MatrixXd& into) const {
  into.setZero(outer.rows(), outer.size() + inner.size());
  for (Eigen::Index o = 0; o < outer.rows(); ++o) {
    Eigen::Index column = o * outer.cols();
    for (const double value : hidden) into(o, column++) = value;
    into(o, column) = 1;
    column = outer.size();
    for (std::size_t j = 0; j < hidden.size(); ++j) {
      const double slope = outer(o, index(j)) * (1 - hidden[j] * hidden[j]);
      for (const double value : scaled) into(o, column++) = slope * value;
      into(o, column++) = slope;
    }
  }
}

}  // namespace treeroll
