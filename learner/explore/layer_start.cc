#include "learner/explore/layer_start.h"

#include <optional>
#include <utility>

#include "learner/explore/power_update.h"
#include "learner/explore/projected_noise.h"

namespace treeroll {
namespace {

/// The roll-outs of the layer left as roll-outs of the next. Those that no policy of the next layer
/// represents (in practice failed ones, with a theta past all bounds) are left out.
std::vector<RatedRollout> projected(const Projection& project,
                                    std::span<const RatedRollout> rollouts) {
  std::vector<RatedRollout> projected;
  for (const RatedRollout& rollout : rollouts) {
    std::optional<Eigen::VectorXd> theta = project(rollout.theta);
    if (theta) projected.push_back({rollout.rollout, rollout.reward, *std::move(theta)});
  }
  return projected;
}

}  // namespace

LayerStart fresh_start(const ExplorationSettings& settings, const Policy& policy) {
  LayerStart start;
  start.distribution.mean = policy.theta();
  start.noise_variance = settings.sensitivity_coordinates
                             ? policy.steps_of_equal_effect().array().square().matrix().eval()
                             : policy.noise_variance(settings.noise_variance);
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
                                 const NextLayer& next, const Eigen::VectorXd& carried,
                                 int num_results_of_run) {
  LayerStart start = fresh_start(settings, *next.policy);
  const std::optional<Eigen::MatrixXd> jacobian =
      projection_jacobian(next.project, carried, left.distribution.noise.diagonal().cwiseSqrt());
  std::optional<Eigen::MatrixXd> learnt;
  if (settings.rule == RuleKind::kPower) {
    start.experience = projected(next.project, left.best);
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
