#include "learner/explore/layer_start.h"

#include <optional>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/experience.h"
#include "learner/explore/power_update.h"
#include "learner/explore/sensitivity.h"

namespace treeroll {
namespace {

/// The variances of one component, repeated for each component of theta.
Eigen::VectorXd repeated(const std::vector<double>& of_component, Eigen::Index theta_dim) {
  const auto size = static_cast<Eigen::Index>(of_component.size());
  CHECK(size > 0 && theta_dim % size == 0, "noise_variance does not fit the size of theta");
  return Eigen::Map<const Eigen::VectorXd>(of_component.data(), size)
      .replicate(theta_dim / size, 1);
}

}  // namespace

LayerStart fresh_start(const ExplorationSettings& settings, const Policy& policy) {
  LayerStart start;
  start.distribution.mean = policy.theta();
  start.noise_variance = settings.sensitivity_coordinates
                             ? sensitivity_scale(policy).array().square().matrix().eval()
                             : repeated(settings.noise_variance, start.distribution.mean.size());
  const double factor = settings.sensitivity_coordinates
                            ? settings.initial_step * settings.initial_step
                            : settings.initial_noise_factor;
  start.distribution.noise = (factor * start.noise_variance).asDiagonal().toDenseMatrix();
  return start;
}

Eigen::VectorXd carried_theta(const ExplorationSettings& settings, const LeftLayer& left) {
  const bool goes_by_best = settings.rule != RuleKind::kPower && settings.reuse &&
                            !left.best.empty() && left.best.front().reward > 0;
  return goes_by_best ? left.best.front().theta : left.distribution.mean;
}

LayerStart start_with_experience(const ExplorationSettings& settings, const LeftLayer& left,
                                 const Policy& next, const Eigen::VectorXd& carried,
                                 int num_results_of_run) {
  LayerStart start = fresh_start(settings, next);
  const std::optional<Eigen::MatrixXd> jacobian = experience_jacobian(
      left.policy, next, carried, left.distribution.noise.diagonal().cwiseSqrt());
  std::optional<Eigen::MatrixXd> learnt;
  if (settings.rule == RuleKind::kPower) {
    start.experience = project_experience(left.policy, next, left.best);
    if (start.experience.empty()) return start;
    std::optional<SearchDistribution> updated =
        power_update(start.experience, start.distribution.mean,
                     minimum_noise_share(settings, num_results_of_run) * start.noise_variance);
    if (updated) learnt = std::move(updated->noise);
  } else if (jacobian && !left.best.empty() && left.best.front().reward > 0) {
    learnt = *jacobian * left.distribution.noise * jacobian->transpose();
  }
  if (!learnt || !jacobian) return start;
  start.distribution.noise =
      with_unexplored_directions(*learnt, *jacobian, start.noise_variance.cwiseSqrt());
  return start;
}

}  // namespace treeroll
