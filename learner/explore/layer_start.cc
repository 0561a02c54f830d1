#include "learner/explore/layer_start.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "learner/explore/exploration_settings.h"
#include "learner/explore/projected_noise.h"
#include "learner/explore/systematic_search.h"
#include "learner/explore/update_rule.h"

namespace treeroll::explore {
std::vector<RatedRollout> projected(const Projection& project,
                                    std::span<const RatedRollout> rollouts) {
  std::vector<RatedRollout> projected;
  for (const RatedRollout& rollout : rollouts) {
    std::optional<Eigen::VectorXd> theta = project(rollout.theta);
    if (theta) projected.push_back({rollout.rollout, rollout.reward, *std::move(theta)});
  }
  return projected;
}

namespace {

/// Times kStepFromNothing: one of these is to be felt.
constexpr double kTriedBolder = 3;
/// In the output's unit, whatever that is; the likeliest first, and closer around it: where all
/// draws of the right size happen to be bad, the next smaller one is not much too small.
constexpr double kTriedScales[] = {1, .2, 5, .02, 50};

/// Of a policy whose size nobody has told: what it does tells it, or several are tried.
void try_scales(const ExplorationSettings& settings, const PolicyEffect& effect,
                LayerStart& start) {
  // A scale counts for what is no output alone.
  const bool is_all_output = (effect.least.array() == 0).all();
  const Eigen::MatrixXd of_outputs =
      is_all_output ? step_covariance(effect, *settings.metric, 1) : Eigen::MatrixXd();
  const auto noise = [&](double scale) -> Eigen::MatrixXd {
    const double step = kStepFromNothing * scale;
    if (is_all_output) return step * step * of_outputs;
    return step * step * step_covariance(effect, *settings.metric, scale);
  };
  if (does_something(effect)) {
    start.distribution.noise = noise(output_size(effect));
  } else {
    for (const double scale : kTriedScales) start.of_scales.push_back(noise(scale));
    start.distribution.noise = start.of_scales.front();
    start.bolder = kTriedBolder;
  }
  start.noise_variance = start.distribution.noise.diagonal();
}

}  // namespace

LayerStart fresh_start(const ExplorationSettings& settings, const Policy& policy) {
  LayerStart start;
  start.distribution.mean = policy.theta();
  if (settings.tries_scale) {
    try_scales(settings, policy.effect(), start);
    return start;
  }
  if (settings.metric) {
    const PolicyEffect effect = policy.effect();
    const Eigen::MatrixXd unit = step_covariance(effect, *settings.metric, settings.output_scale);
    start.distribution.noise = *settings.initial_step * *settings.initial_step * unit;
    start.noise_variance = start.distribution.noise.diagonal();
    start.bolder = settings.bold_step / *settings.initial_step;
    return start;
  }
  start.noise_variance = settings.initial_step
                             ? policy.steps_of_equal_effect().array().square().matrix().eval()
                             : policy.noise_variance(settings.noise_variance);
  const double factor = settings.initial_step ? *settings.initial_step * *settings.initial_step
                                              : settings.initial_noise_factor;
  start.distribution.noise = (factor * start.noise_variance).asDiagonal().toDenseMatrix();
  return start;
}

LayerStart first_start(const ExplorationSettings& settings, const Policy& start) {
  const PolicyPtr policy = start.at_layer(settings.first_layer);
  LayerStart first = fresh_start(settings, *policy);
  if (!settings.metric || settings.tries_scale) return first;
  const PolicyEffect effect = policy->effect();
  if (does_something(effect)) {
    const double boldness =
        settings.boldness * std::min(1., settings.output_scale / output_size(effect));
    first.systematic_steps = systematic_steps(effect, boldness, policy->input_dim());
  }
  return first;
}

LayerStart start_with_experience(const ExplorationSettings& settings, const UpdateRule& rule,
                                 const NextLayer& next, const Eigen::VectorXd& carried,
                                 int num_results_of_run) {
  LayerStart start = fresh_start(settings, *next.policy);
  start.bolder = 1;
  start.of_scales.clear();
  const std::optional<Eigen::MatrixXd> jacobian =
      projection_jacobian(next.project, carried, rule.distribution().noise.diagonal().cwiseSqrt());
  Inheritance given = rule.inheritance({next.project, start, jacobian, num_results_of_run});
  start.experience = std::move(given.experience);
  if (given.noise && jacobian) {
    start.distribution.noise =
        with_unexplored_directions(*given.noise, *jacobian, start.noise_variance.cwiseSqrt());
  }
  return start;
}

}  // namespace treeroll::explore
