#include "learner/explore/layer_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/perturbation.h"

namespace treeroll {

LayerSearch::LayerSearch(const ExplorationSettings& settings, LayerStart start)
    : rule_(make_update_rule(settings, std::move(start))),
      distribution_(std::make_shared<SearchDistribution>(rule_->distribution())),
      window_(settings.convergence_window) {
  if (settings.convergence_gain) gains_.emplace(settings.convergence_window);
}

bool LayerSearch::may_draw(const ExplorationSettings& settings) const {
  if (settings.rule == RuleKind::kPower || !settings.complete_generations) return true;
  const std::int64_t population = settings.population;
  return num_drawn_ < (num_results_ / population + 1) * population;
}

LayerSearch::Drawn LayerSearch::draw(const ExplorationSettings& settings, RandomStream stream) {
  CHECK(may_draw(settings), "the rule waits for its generation");
  ++num_drawn_;
  if (!factor_) factor_ = noise_factor(distribution_->noise);
  Eigen::VectorXd normal;
  if (to_mirror_) {
    normal = -*to_mirror_;
    to_mirror_.reset();
  } else {
    normal = normal_numbers(distribution_->mean.size(), stream);
    if (settings.rule == RuleKind::kCmaEs && settings.mirrored) to_mirror_ = normal;
  }
  return {perturb(distribution_->mean, *factor_, normal), distribution_};
}

void LayerSearch::learn(const ToldRollout& told, int num_results_of_run) {
  ++num_results_;
  window_.add(told.rated.reward);
  if (gains_) gains_->add(told.rated.reward);
  if (!rule_->learn(told, num_results_of_run)) return;
  distribution_ = std::make_shared<SearchDistribution>(rule_->distribution());
  factor_.reset();
}

bool LayerSearch::has_converged(const ExplorationSettings& settings) const {
  const int first_update =
      settings.rule == RuleKind::kPower ? settings.first_update : settings.population;
  const std::int64_t enough =
      std::int64_t{std::max(settings.convergence_window, first_update)} + settings.in_flight - 1;
  if (num_results_ < enough) return false;
  if (!settings.convergence_gain) return *window_.slope() < settings.convergence_slope;
  const std::optional<double> share = gains_->share();
  return share && *share < *settings.convergence_gain;
}

}  // namespace treeroll
