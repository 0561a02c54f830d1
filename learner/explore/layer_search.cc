#include "learner/explore/layer_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/perturbation.h"

namespace treeroll::explore {

LayerSearch::LayerSearch(const ExplorationSettings& settings, LayerStart start)
    : rule_(settings.rule.make(std::move(start))),
      distribution_(std::make_shared<SearchDistribution>(rule_->distribution())),
      window_(settings.convergence_window) {
  if (settings.convergence_gain) gains_.emplace(settings.convergence_window);
}

LayerSearch::Drawn LayerSearch::draw(RandomStream stream) {
  CHECK(may_draw(), "the rule waits for results");
  ++num_drawn_;
  if (!factor_) factor_ = noise_factor(distribution_->noise);
  return {perturb(distribution_->mean, *factor_, rule_->next_normal_numbers(stream)),
          distribution_};
}

void LayerSearch::learn(const ToldRollout& told, int num_results_of_run) {
  if (!rule_->is_trial()) {
    ++num_results_;
    window_.add(told.rated.reward);
    if (gains_) gains_->add(told.rated.reward);
  }
  if (!rule_->learn(told, num_results_of_run)) return;
  distribution_ = std::make_shared<SearchDistribution>(rule_->distribution());
  factor_.reset();
}

bool LayerSearch::has_converged(const ExplorationSettings& settings) const {
  const std::int64_t enough =
      std::int64_t{std::max(settings.convergence_window, rule_->first_update())} +
      settings.in_flight - 1;
  if (num_results_ < enough) return false;
  if (!settings.convergence_gain) return *window_.slope() < settings.convergence_slope;
  const std::optional<double> share = gains_->share();
  return share && *share < *settings.convergence_gain;
}

}  // namespace treeroll::explore
