#include "learner/explore/metric.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"

namespace treeroll::explore {
namespace {

constexpr double kLeastShare = .1;
constexpr double kLeastDirection = 1e-3;  // of the mean square
/// Outputs of a start that does something are larger: the least factor that a setting may have.
constexpr double kNothing = 1e-12;
/// Of the largest output: what is smaller is what rounding leaves of 0.
constexpr double kRounding = 1e-12;

/// The output that an element of theta moves most: the element is in its unit.
Eigen::Index output_moved(const PolicyEffect& effect, Eigen::Index element) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(effect.outputs.cols());
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    const double derivative = effect.derivative(row, element);
    squares[row % squares.size()] += derivative * derivative;
  }
  Eigen::Index output = 0;
  squares.maxCoeff(&output);
  return output;
}

/// For each element in an output's unit, the largest of those that are in the same unit. For one
/// that moves nothing, whose unit nobody knows, the largest of all.
/// @param squares  of the elements, mean over inputs
Eigen::VectorXd strongest_alike(const PolicyEffect& effect, const Eigen::VectorXd& squares) {
  std::vector<Eigen::Index> outputs;
  Eigen::VectorXd of_output = Eigen::VectorXd::Zero(effect.outputs.cols());
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    outputs.push_back(output_moved(effect, i));
    if (effect.least[i] != 0) continue;
    double& largest = of_output[outputs.back()];
    largest = std::max(largest, squares[i]);
  }
  Eigen::VectorXd strongest(squares.size());
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    strongest[i] =
        squares[i] > 0 ? of_output[outputs[static_cast<std::size_t>(i)]] : of_output.maxCoeff();
  }
  return strongest;
}

}  // namespace

double output_size(const PolicyEffect& effect) {
  return std::sqrt(effect.outputs.rowwise().squaredNorm().mean());
}

std::vector<double> output_sizes(const PolicyEffect& effect) {
  const Eigen::VectorXd rms = effect.outputs.colwise().squaredNorm().transpose().array().sqrt() /
                              std::sqrt(static_cast<double>(effect.outputs.rows()));
  const double least = std::max(kNothing, kRounding * rms.maxCoeff());
  double smallest = rms.maxCoeff();
  for (const double size : rms) {
    if (size > least) smallest = std::min(smallest, size);
  }
  std::vector<double> sizes;
  for (const double size : rms) sizes.push_back(size > least ? size : smallest);
  return sizes;
}

bool does_something(const PolicyEffect& effect) {
  return std::sqrt(effect.outputs.colwise().squaredNorm().maxCoeff() /
                   static_cast<double>(effect.outputs.rows())) > kNothing;
}

std::vector<double> shares_of(const std::vector<double>& sizes) {
  if (sizes.size() == 1) return {};
  double squares = 0;
  for (const double size : sizes) squares += size * size;
  const double mean = std::sqrt(squares / static_cast<double>(sizes.size()));
  std::vector<double> shares;
  for (const double size : sizes) shares.push_back(size / mean);
  return shares;
}

PolicyEffect in_shares(PolicyEffect effect, const std::vector<double>& shares) {
  if (shares.empty()) return effect;
  const Eigen::Index num_outputs = effect.outputs.cols();
  CHECK(std::ssize(shares) == num_outputs, "a share for each output");
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    effect.derivative.row(row) /= shares[static_cast<std::size_t>(row % num_outputs)];
  }
  for (Eigen::Index o = 0; o < num_outputs; ++o) {
    effect.outputs.col(o) /= shares[static_cast<std::size_t>(o)];
  }
  return effect;
}

Eigen::MatrixXd step_covariance(const PolicyEffect& effect, Metric metric, double scale) {
  const Eigen::Index n = effect.derivative.cols();
  CHECK(scale > 0 && effect.least.size() == n, "the output has a size");
  const auto num_inputs = static_cast<double>(effect.outputs.rows());
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    add_square(effect.derivative.row(row).transpose(), squares);
  }
  squares = mirrored(squares / num_inputs);
  const Eigen::VectorXd strongest = strongest_alike(effect, squares.diagonal());
  for (Eigen::Index i = 0; i < n; ++i) {
    if (effect.least[i] == 0) {
      squares(i, i) = std::max(squares(i, i), kLeastShare * kLeastShare * strongest[i]);
    } else {
      squares(i, i) += effect.least[i] * effect.least[i] * scale * scale;
    }
  }
  CHECK(squares.allFinite() && squares.diagonal().minCoeff() > 0,
        "a policy whose output nothing moves");
  const Eigen::VectorXd unit = squares.diagonal().cwiseSqrt().cwiseInverse();
  if (metric == Metric::kDiagonal) return unit.array().square().matrix().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(
      mirrored(unit.asDiagonal() * squares * unit.asDiagonal()));
  CHECK(axes.info() == Eigen::Success, "a finite symmetric matrix has eigenvalues");
  const Eigen::VectorXd inverse =
      (axes.eigenvalues().array() + kLeastDirection * axes.eigenvalues().maxCoeff())
          .inverse()
          .matrix();
  return mirrored(unit.asDiagonal() *
                  (axes.eigenvectors() * inverse.asDiagonal() * axes.eigenvectors().transpose()) *
                  unit.asDiagonal());
}

}  // namespace treeroll::explore
