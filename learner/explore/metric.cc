#include "learner/explore/metric.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"

namespace treeroll::explore {
namespace {

constexpr double kLeastShare = .1;
constexpr double kLeastDirection = 1e-3;  // of the mean square
/// Outputs of a start that does something are larger: the least factor that a setting may have.
constexpr double kNothing = 1e-12;

}  // namespace

double output_size(const PolicyEffect& effect) {
  return std::sqrt(effect.outputs.rowwise().squaredNorm().mean());
}

bool does_something(const PolicyEffect& effect) { return output_size(effect) > kNothing; }

Eigen::MatrixXd step_covariance(const PolicyEffect& effect, Metric metric, double scale) {
  const Eigen::Index n = effect.derivative.cols();
  CHECK(scale > 0 && effect.least.size() == n, "the output has a size");
  const auto num_inputs = static_cast<double>(effect.outputs.rows());
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index row = 0; row < effect.derivative.rows(); ++row) {
    add_square(effect.derivative.row(row).transpose(), squares);
  }
  squares = mirrored(squares / num_inputs);
  double largest = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (effect.least[i] == 0) largest = std::max(largest, squares(i, i));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (effect.least[i] == 0) {
      squares(i, i) = std::max(squares(i, i), kLeastShare * kLeastShare * largest);
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
