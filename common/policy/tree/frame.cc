#include "common/policy/tree/frame.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

namespace treeroll {
namespace {

/// Difference of two variances, relative to their sum, below which rounding alone decides where
/// the axes of an ellipse point.
constexpr double kCircle = 1e-12;

/// Axis of the largest variance in two dimensions, unit length, any sign; none for a circle.
/// With the angle phi: cos(2 phi) = h / r, sin(2 phi) = b / r. Only square roots, so that it is
/// the same everywhere.
std::optional<Eigen::Vector2d> major_axis(const Eigen::MatrixXd& covariance) {
  const double h = .5 * (covariance(0, 0) - covariance(1, 1));
  const double b = covariance(1, 0);
  const double r = std::sqrt(h * h + b * b);
  if (r <= kCircle * (covariance(0, 0) + covariance(1, 1))) return std::nullopt;
  if (h >= 0) {
    const double cosine = std::sqrt(.5 * (1 + h / r));
    return Eigen::Vector2d(cosine, .5 * (b / r) / cosine);
  }
  const double sine = std::sqrt(.5 * (1 - h / r));
  return Eigen::Vector2d(.5 * (b / r) / sine, sine);
}

Eigen::MatrixXd right_handed(const Eigen::Vector2d& axis) {
  Eigen::MatrixXd axes(2, 2);
  axes << axis[0], -axis[1], axis[1], axis[0];
  return axes;
}

/// Eigenvectors, largest eigenvalue first, any signs.
Eigen::MatrixXd eigenvectors(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  if (solver.info() != Eigen::Success) {
    throw std::invalid_argument("the covariance has no numerical eigenvectors");
  }
  return solver.eigenvectors().rowwise().reverse();
}

/// The columns of `axes` in the order in which they overlap most with those of `before`.
Eigen::MatrixXd matched(const Eigen::MatrixXd& axes, const Eigen::MatrixXd& before) {
  const Eigen::Index dim = axes.cols();
  Eigen::MatrixXd overlap = (before.transpose() * axes).cwiseAbs();
  Eigen::MatrixXd ordered(dim, dim);
  for (Eigen::Index i = 0; i < dim; ++i) {
    Eigen::Index old_axis = 0;
    Eigen::Index new_axis = 0;
    overlap.maxCoeff(&old_axis, &new_axis);
    ordered.col(old_axis) = axes.col(new_axis);
    overlap.row(old_axis).setConstant(-1);
    overlap.col(new_axis).setConstant(-1);
  }
  return ordered;
}

}  // namespace

Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factorised(covariance);
  if (factorised.info() != Eigen::Success) {
    throw std::invalid_argument("the covariance must be positive definite");
  }
  return factorised.matrixL();
}

Eigen::MatrixXd principal_axes(const Eigen::MatrixXd& covariance) {
  const Eigen::Index dim = covariance.rows();
  Eigen::MatrixXd axes(dim, dim);
  if (dim == 2) {
    axes = right_handed(major_axis(covariance).value_or(Eigen::Vector2d(1, 0)));
  } else {
    axes = eigenvectors(covariance);
  }
  for (Eigen::Index i = 0; i < dim; ++i) {
    Eigen::Index largest = 0;
    axes.col(i).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, i) < 0) axes.col(i) = -axes.col(i);
  }
  if (axes.determinant() < 0) axes.col(dim - 1) = -axes.col(dim - 1);
  return axes;
}

Eigen::MatrixXd principal_axes(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& before) {
  const Eigen::Index dim = covariance.rows();
  if (dim == 2) {
    const std::optional<Eigen::Vector2d> axis = major_axis(covariance);
    if (!axis) return before;
    const double overlap = before(0, 0) * (*axis)[0] + before(1, 0) * (*axis)[1];
    return right_handed(overlap < 0 ? Eigen::Vector2d(-*axis) : *axis);
  }
  Eigen::MatrixXd axes = matched(eigenvectors(covariance), before);
  Eigen::Index weakest = 0;
  double weakest_overlap = 2;
  for (Eigen::Index i = 0; i < dim; ++i) {
    const double overlap = before.col(i).dot(axes.col(i));
    if (overlap < 0) axes.col(i) = -axes.col(i);
    if (std::abs(overlap) < weakest_overlap) {
      weakest = i;
      weakest_overlap = std::abs(overlap);
    }
  }
  if (axes.determinant() < 0) axes.col(weakest) = -axes.col(weakest);
  return axes;
}

}  // namespace treeroll
