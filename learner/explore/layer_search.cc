#include "learner/explore/layer_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/experience.h"
#include "learner/explore/perturbation.h"

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

LayerSearch::LayerSearch(const ExplorationSettings& settings, Eigen::VectorXd theta)
    : noise_variance_(repeated(settings.noise_variance, theta.size())),
      history_(settings.best_considered),
      window_(settings.convergence_window) {
  distribution_.noise =
      (settings.initial_noise_factor * noise_variance_).asDiagonal().toDenseMatrix();
  distribution_.mean = std::move(theta);
}

Eigen::VectorXd LayerSearch::minimum_noise(const ExplorationSettings& settings,
                                           int num_results_of_run) const {
  return settings.minimum_noise_fraction * minimum_noise_decay(settings, num_results_of_run) *
         noise_variance_;
}

void LayerSearch::reuse(const ExplorationSettings& settings, std::vector<RatedRollout> experience,
                        const std::optional<Eigen::MatrixXd>& jacobian, int num_results_of_run) {
  CHECK(num_results_ == 0 && !factor_, "experience is what a search begins with");
  for (RatedRollout& rollout : experience) history_.add(std::move(rollout));
  if (history_.ranked().empty()) return;
  has_experience_ = true;
  if (!jacobian) return;
  const std::optional<SearchDistribution> learnt = power_update(
      history_.ranked(), distribution_.mean, minimum_noise(settings, num_results_of_run));
  if (!learnt) return;
  // The mean is the policy the layer left came to: experience shapes only the noise.
  distribution_.noise =
      with_unexplored_directions(learnt->noise, *jacobian, noise_variance_.cwiseSqrt());
}

Eigen::VectorXd LayerSearch::draw(RandomStream stream) {
  if (!factor_) factor_ = noise_factor(distribution_.noise);
  return perturb(distribution_.mean, *factor_, stream);
}

void LayerSearch::learn(const ExplorationSettings& settings, RatedRollout rollout,
                        int num_results_of_run) {
  ++num_results_;
  window_.add(rollout.reward);
  history_.add(std::move(rollout));
  if (!has_experience_ && num_results_ < settings.first_update) return;

  std::optional<SearchDistribution> updated = power_update(
      history_.ranked(), distribution_.mean, minimum_noise(settings, num_results_of_run));
  if (!updated) return;
  distribution_ = *std::move(updated);
  factor_.reset();
}

bool LayerSearch::has_converged(const ExplorationSettings& settings) const {
  const std::int64_t enough =
      std::int64_t{std::max(settings.convergence_window, settings.first_update)} +
      settings.in_flight - 1;
  return num_results_ >= enough && *window_.slope() < settings.convergence_slope;
}

}  // namespace treeroll
