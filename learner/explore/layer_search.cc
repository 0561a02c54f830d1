#include "learner/explore/layer_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
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

Eigen::VectorXd LayerSearch::draw(RandomStream stream) {
  if (!factor_) factor_ = noise_factor(distribution_.noise);
  return perturb(distribution_.mean, *factor_, stream);
}

void LayerSearch::learn(const ExplorationSettings& settings, RatedRollout rollout,
                        int num_results_of_run) {
  ++num_results_;
  window_.add(rollout.reward);
  history_.add(std::move(rollout));
  if (num_results_ < settings.first_update) return;

  const double fraction =
      settings.minimum_noise_fraction * minimum_noise_decay(settings, num_results_of_run);
  std::optional<SearchDistribution> updated =
      power_update(history_.ranked(), distribution_.mean, fraction * noise_variance_);
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
