#include "learner/explore/layer_start.h"

#include <optional>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/experience.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/sensitivity.h"
#include "learner/explore/update_rule.h"

namespace treeroll::explore {
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
  start.noise_variance = settings.initial_step
                             ? sensitivity_scale(policy).array().square().matrix().eval()
                             : repeated(settings.noise_variance, start.distribution.mean.size());
  const double factor = settings.initial_step ? *settings.initial_step * *settings.initial_step
                                              : settings.initial_noise_factor;
  start.distribution.noise = (factor * start.noise_variance).asDiagonal().toDenseMatrix();
  return start;
}

LayerStart start_with_experience(const ExplorationSettings& settings, const UpdateRule& rule,
                                 const Policy& left, const Policy& next,
                                 const Eigen::VectorXd& carried, int num_results_of_run) {
  LayerStart start = fresh_start(settings, next);
  const std::optional<Eigen::MatrixXd> jacobian =
      experience_jacobian(left, next, carried, rule.distribution().noise.diagonal().cwiseSqrt());
  Inheritance given = rule.inheritance({left, next, start, jacobian, num_results_of_run});
  start.experience = std::move(given.experience);
  if (given.noise && jacobian) {
    start.distribution.noise =
        with_unexplored_directions(*given.noise, *jacobian, start.noise_variance.cwiseSqrt());
  }
  return start;
}

}  // namespace treeroll::explore
