#include "learner/explore/projected_noise.h"

#include <Eigen/QR>

#include "common/base/check.h"
#include "common/numbers/mirrored.h"

namespace treeroll::explore {
namespace {

/// Deviation given to unexplored directions, as a share of that of the explored ones.
constexpr double kUnexploredShare = .3;
/// Step of the central differences as a share of the deviation: the projection curves on the scale
/// of theta itself, far above it; rounding matters far below it.
constexpr double kDifferenceShare = 1e-3;
/// Columns this small beside the largest are what differences leave of a dependent column.
constexpr double kDependent = 1e-7;

}  // namespace

std::optional<Eigen::MatrixXd> projection_jacobian(const Projection& project,
                                                   const Eigen::VectorXd& theta,
                                                   const Eigen::VectorXd& deviation) {
  Eigen::MatrixXd jacobian;
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const double step = kDifferenceShare * deviation[i];
    Eigen::VectorXd ahead = theta;
    Eigen::VectorXd behind = theta;
    ahead[i] += step;
    behind[i] -= step;
    const std::optional<Eigen::VectorXd> there = project(ahead);
    const std::optional<Eigen::VectorXd> back = project(behind);
    // The step as it was rounded into theta.
    const double taken = ahead[i] - behind[i];
    if (!there || !back || taken <= 0) return std::nullopt;
    if (i == 0) jacobian.resize(there->size(), theta.size());
    jacobian.col(i) = (*there - *back) / taken;
  }
  if (!jacobian.allFinite()) return std::nullopt;
  return jacobian;
}

Eigen::MatrixXd with_unexplored_directions(const Eigen::MatrixXd& noise,
                                           const Eigen::MatrixXd& jacobian,
                                           const Eigen::VectorXd& unit) {
  const Eigen::Index n = noise.rows();
  CHECK(jacobian.rows() == n && unit.size() == n, "noise, jacobian and unit differ in size");
  // Columns of one length: which directions were explored, not how far.
  Eigen::MatrixXd directions = unit.cwiseInverse().asDiagonal() * jacobian;
  for (Eigen::Index i = 0; i < directions.cols(); ++i) directions.col(i).normalize();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(directions);
  qr.setThreshold(kDependent);
  const Eigen::Index rank = qr.rank();
  CHECK(rank > 0, "a projection that nothing moves");
  const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(n, rank);
  const Eigen::MatrixXd in_units =
      unit.cwiseInverse().asDiagonal() * noise * unit.cwiseInverse().asDiagonal();
  const double explored =
      (basis.transpose() * in_units * basis).trace() / static_cast<double>(rank);
  const Eigen::MatrixXd unexplored = Eigen::MatrixXd::Identity(n, n) - basis * basis.transpose();
  return mirrored(noise + kUnexploredShare * kUnexploredShare * explored *
                              (unit.asDiagonal() * unexplored * unit.asDiagonal()).eval());
}

}  // namespace treeroll::explore
