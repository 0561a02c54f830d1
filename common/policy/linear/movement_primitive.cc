#include "common/policy/linear/movement_primitive.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll {
namespace {

constexpr double kStiffness = 25;  // al
constexpr double kDamping = kStiffness / 4;
constexpr double kDecay = 4.605170185988091;  // a, log(100)

/// Centres c_i of the weights in s, and how narrow each is.
struct Kernels {
  std::vector<double> centres;
  std::vector<double> narrowness;
};

Kernels kernels(int num_weights) {
  Kernels kernels;
  for (int i = 0; i < num_weights; ++i) {
    kernels.centres.push_back(elementary::exp(-kDecay * i / (num_weights - 1)));
  }
  for (std::size_t i = 0; i + 1 < kernels.centres.size(); ++i) {
    const double apart = kernels.centres[i] - kernels.centres[i + 1];
    kernels.narrowness.push_back(.5 / (apart * apart));
  }
  kernels.narrowness.push_back(kernels.narrowness.back());
  return kernels;
}

/// s psi_i / sum psi, of all weights at a time as a share of the range.
Eigen::VectorXd forcing(const Kernels& kernels, double share) {
  const double s = elementary::exp(-kDecay * share);
  Eigen::VectorXd force(kernels.centres.size());
  double sum = 0;
  for (std::size_t i = 0; i < kernels.centres.size(); ++i) {
    const double apart = s - kernels.centres[i];
    const double psi = elementary::exp(-kernels.narrowness[i] * apart * apart);
    force[static_cast<Eigen::Index>(i)] = psi;
    sum += psi;
  }
  return force * (s / sum);
}

/// From rest at 1 with the goal at 0: critically damped, (1 + r) exp(-r), r = al / 2 of the share.
double response_of_start(double share) {
  const double r = kStiffness / 2 * share;
  return (1 + r) * elementary::exp(-r);
}

/// State of all weights' unit responses at once; time in units of tau.
struct State {
  Eigen::ArrayXd x;
  Eigen::ArrayXd z;
};

State slope(const State& at, const Eigen::ArrayXd& force) {
  return {at.z, kStiffness * (-kDamping * at.x - at.z) + force};
}

State moved(const State& at, const State& slope, double by) {
  return {at.x + by * slope.x, at.z + by * slope.z};
}

}  // namespace

MovementPrimitive::MovementPrimitive(int num_weights, double low, double high)
    : low_(low), high_(high), responses_(num_weights + 1, kSteps + 1) {
  CHECK(num_weights >= 2 && low < high, "no such movement primitives");
  const Kernels of_weights = kernels(num_weights);
  constexpr double kStep = 1. / kSteps;
  State state{Eigen::ArrayXd::Zero(num_weights), Eigen::ArrayXd::Zero(num_weights)};
  Eigen::ArrayXd force = forcing(of_weights, 0);
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(num_weights);
  responses_.col(0).setZero();
  for (int n = 0; n < kSteps; ++n) {
    // Runge and Kutta's method of order 4.
    const Eigen::ArrayXd between = forcing(of_weights, (n + .5) * kStep);
    const Eigen::ArrayXd after = forcing(of_weights, (n + 1) * kStep);
    const State k1 = slope(state, force);
    const State k2 = slope(moved(state, k1, kStep / 2), between);
    const State k3 = slope(moved(state, k2, kStep / 2), between);
    const State k4 = slope(moved(state, k3, kStep), after);
    state.x += kStep / 6 * (k1.x + 2 * k2.x + 2 * k3.x + k4.x);
    state.z += kStep / 6 * (k1.z + 2 * k2.z + 2 * k3.z + k4.z);
    force = after;
    responses_.col(n + 1).head(num_weights) = state.x.matrix();
    squares += state.x * state.x / kSteps;
  }
  for (int i = 0; i < num_weights; ++i) responses_.row(i) /= std::sqrt(squares[i]);
  for (int n = 0; n <= kSteps; ++n) {
    responses_(num_weights, n) = 1 - response_of_start(n * kStep);
  }
  CHECK(responses_.allFinite(), "every weight moves the output");
}

int MovementPrimitive::values(double input, std::span<double> values) const {
  const double place = (std::clamp(input, low_, high_) - low_) / (high_ - low_) * kSteps;
  const int before = std::min(static_cast<int>(place), kSteps - 1);
  const double share = place - before;
  for (Eigen::Index i = 0; i < responses_.rows(); ++i) {
    values[static_cast<std::size_t>(i)] =
        (1 - share) * responses_(i, before) + share * responses_(i, before + 1);
  }
  return 0;
}

RecordedCurvePtr MovementPrimitive::from(const std::vector<double>& starts) const {
  std::vector<double> inputs;
  Eigen::MatrixXd outputs(starts.size(), kSteps + 1);
  for (int n = 0; n <= kSteps; ++n) {
    inputs.push_back(low_ + (high_ - low_) * n / kSteps);
    for (std::size_t o = 0; o < starts.size(); ++o) {
      outputs(static_cast<Eigen::Index>(o), n) =
          starts[o] * response_of_start(static_cast<double>(n) / kSteps);
    }
  }
  return std::make_shared<RecordedCurve>(std::move(inputs), std::move(outputs));
}

}  // namespace treeroll
