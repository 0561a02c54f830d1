#include "learner/fit/split.h"

#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

Eigen::VectorXd axis_of(const Component& component, SplitAxis axis) {
  if (axis == SplitAxis::kCholesky) return cholesky_factor(component.covariance).col(0);
  const Eigen::VectorXd direction = principal_axes(component.covariance).col(0);
  return std::sqrt(direction.dot(component.covariance * direction)) * direction;
}

}  // namespace

std::pair<Component, Component> split(const Component& component, const SplitSettings& settings) {
  const double alpha = settings.alpha;
  const double beta = settings.beta;
  const double u = settings.u;
  CHECK(alpha > 0 && alpha < 1 && beta > 0 && beta < 1 && u > 0 && u < 1,
        "the parameters of a split are in (0, 1)");
  const Eigen::VectorXd a = axis_of(component, settings.axis);
  const Eigen::MatrixXd aa = a * a.transpose();
  // (3-6), corrected. Ratios of priors: pi_j = alpha pi_i, pi_k = (1 - alpha) pi_i.
  const double k_over_j = (1 - alpha) / alpha;
  const double j_over_k = alpha / (1 - alpha);
  Component j;
  j.prior = alpha * component.prior;
  j.mean = component.mean - std::sqrt(k_over_j) * u * a;
  j.covariance = k_over_j * component.covariance + ((beta - beta * u * u - 1) / alpha + 1) * aa;
  Component k;
  k.prior = (1 - alpha) * component.prior;
  k.mean = component.mean + std::sqrt(j_over_k) * u * a;
  k.covariance =
      j_over_k * component.covariance + ((beta * u * u - beta - u * u) / (1 - alpha) + 1) * aa;
  return {std::move(j), std::move(k)};
}

Component merge(const Component& first, const Component& second) {
  Component merged;
  merged.prior = first.prior + second.prior;
  CHECK(merged.prior > 0, "what is merged has weight");
  const double share = first.prior / merged.prior;
  const Eigen::VectorXd apart = second.mean - first.mean;
  merged.mean = first.mean + (1 - share) * apart;
  merged.covariance = share * first.covariance + (1 - share) * second.covariance +
                      share * (1 - share) * apart * apart.transpose();
  return merged;
}

}  // namespace treeroll
