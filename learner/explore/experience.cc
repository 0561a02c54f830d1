#include "learner/explore/experience.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

/// Deviation given to unexplored directions, as a share of that of the explored ones.
constexpr double kUnexploredShare = .3;
/// Step of the central differences as a share of the deviation: the projection curves on the scale
/// of theta itself, far above it; rounding matters far below it.
constexpr double kDifferenceShare = 1e-3;
/// Columns this small beside the largest are what differences leave of a dependent column.
constexpr double kDependent = 1e-7;

/// One component of the next layer: `held` says which input marginal theta leaves.
Component projected(const Component& rollout, const Component& held, int num_inputs) {
  const int num_outputs = static_cast<int>(held.mean.size()) - num_inputs;
  const auto slope_of = [&](const Component& component) -> Eigen::MatrixXd {
    const Eigen::MatrixXd s_io = component.covariance.topRightCorner(num_inputs, num_outputs);
    const Eigen::LLT<Eigen::MatrixXd> s_ii(
        component.covariance.topLeftCorner(num_inputs, num_inputs));
    return s_ii.solve(s_io).transpose();
  };
  const Eigen::MatrixXd slope = slope_of(rollout);
  const Eigen::MatrixXd held_slope = slope_of(held);
  const Eigen::MatrixXd s_ii = held.covariance.topLeftCorner(num_inputs, num_inputs);

  Component result = held;
  result.mean.tail(num_outputs) =  // (3-18)
      rollout.mean.tail(num_outputs) +
      slope * (held.mean.head(num_inputs) - rollout.mean.head(num_inputs));
  const Eigen::MatrixXd s_oi = slope * s_ii;  // (3-17)
  // The variance around the line is not theta's: it stays.
  const Eigen::MatrixXd around_line = held.covariance.bottomRightCorner(num_outputs, num_outputs) -
                                      held_slope * s_ii * held_slope.transpose();
  result.covariance.bottomLeftCorner(num_outputs, num_inputs) = s_oi;
  result.covariance.topRightCorner(num_inputs, num_outputs) = s_oi.transpose();
  result.covariance.bottomRightCorner(num_outputs, num_outputs) =
      mirrored(around_line + slope * s_ii * slope.transpose());
  return result;
}

}  // namespace

std::optional<Eigen::VectorXd> project_experience(const Policy& left, const Policy& next,
                                                  const Eigen::VectorXd& theta) {
  CHECK(next.layer == left.layer + 1 && next.layout == left.layout,
        "experience goes from a layer to the one below it");
  try {
    const Gmm rollout = left.tree_with(theta).layer(next.layer);
    const Gmm mean = next.tree.layer(next.layer);
    // What theta holds of the roll-out's mixture, and the rest as it is: tells the input means and
    // variances the projected mixture has, whatever the layout.
    const Gmm held = with_theta(next.layout, mean, to_theta(next.layout, rollout));
    std::vector<Component> components;
    components.reserve(held.components().size());
    for (int k = 0; k < held.num_components(); ++k) {
      components.push_back(projected(rollout[k], held[k], held.input_dim()));
    }
    Eigen::VectorXd result = to_theta(next.layout, Gmm(held.input_dim(), std::move(components)));
    if (!result.allFinite()) return std::nullopt;
    return result;
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

std::vector<explore::RatedRollout> project_experience(
    const Policy& left, const Policy& next, std::span<const explore::RatedRollout> rollouts) {
  std::vector<explore::RatedRollout> projected;
  for (const explore::RatedRollout& rollout : rollouts) {
    std::optional<Eigen::VectorXd> theta = project_experience(left, next, rollout.theta);
    if (theta) projected.push_back({rollout.rollout, rollout.reward, *std::move(theta)});
  }
  return projected;
}

std::optional<Eigen::MatrixXd> experience_jacobian(const Policy& left, const Policy& next,
                                                   const Eigen::VectorXd& theta,
                                                   const Eigen::VectorXd& deviation) {
  Eigen::MatrixXd jacobian(next.theta_dim(), left.theta_dim());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const double step = kDifferenceShare * deviation[i];
    Eigen::VectorXd ahead = theta;
    Eigen::VectorXd behind = theta;
    ahead[i] += step;
    behind[i] -= step;
    const auto there = project_experience(left, next, ahead);
    const auto back = project_experience(left, next, behind);
    // The step as it was rounded into theta.
    const double taken = ahead[i] - behind[i];
    if (!there || !back || taken <= 0) return std::nullopt;
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

}  // namespace treeroll
