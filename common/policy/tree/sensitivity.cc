#include "common/policy/tree/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/check.h"
#include "common/mixture/gmr.h"
#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

constexpr double kDeviations[] = {-1.5, -1, -.5, 0, .5, 1, 1.5};
constexpr double kLeastShare = 1e-6;

struct WeightedInput {
  double weight;
  Eigen::VectorXd input;
};

std::vector<WeightedInput> inputs_of(const Gmm& gmm) {
  const int num_inputs = gmm.input_dim();
  std::vector<WeightedInput> inputs;
  for (const Component& component : gmm.components()) {
    const Eigen::MatrixXd factor =
        cholesky_factor(component.covariance.topLeftCorner(num_inputs, num_inputs));
    for (int axis = 0; axis < num_inputs; ++axis) {
      for (const double deviations : kDeviations) {
        inputs.push_back(
            {component.prior, component.mean.head(num_inputs) + deviations * factor.col(axis)});
      }
    }
  }
  return inputs;
}

}  // namespace

Eigen::VectorXd sensitivity_scale(const TreePolicy& policy) {
  const Eigen::VectorXd theta = policy.theta();
  const std::vector<WeightedInput> inputs = inputs_of(policy.tree().finest());
  double weight_sum = 0;
  for (const WeightedInput& at : inputs) weight_sum += at.weight;

  Eigen::VectorXd rms(theta.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    // Half of the digits for the step, the others for the difference it makes.
    const double step = 1e-5 * std::max(1e-3, std::abs(theta[i]));
    Eigen::VectorXd ahead = theta;
    Eigen::VectorXd behind = theta;
    ahead[i] += step;
    behind[i] -= step;
    const Gmr there(policy.decode(ahead));
    const Gmr back(policy.decode(behind));
    double sum = 0;
    for (const WeightedInput& at : inputs) {
      const Eigen::VectorXd change = there.regress(at.input) - back.regress(at.input);
      sum += at.weight * change.squaredNorm();
    }
    rms[i] = std::sqrt(sum / weight_sum) / (ahead[i] - behind[i]);
  }
  const double largest = rms.maxCoeff();
  CHECK(std::isfinite(largest) && largest > 0, "a policy whose output nothing moves");
  return rms.cwiseMax(kLeastShare * largest).cwiseInverse();
}

}  // namespace treeroll
