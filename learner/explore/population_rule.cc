#include "learner/explore/population_rule.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/weighted_update.h"

namespace treeroll {
namespace {

/// A noise without a floor stays above this share of noise_variance, 1e-10 of its deviations: far
/// below what any reward can tell, far above where its numbers would run out.
constexpr double kLeastNoise = 1e-20;

}  // namespace

PopulationRule::PopulationRule(const ExplorationSettings& settings, LayerStart start)
    : settings_(settings),
      distribution_(std::move(start.distribution)),
      noise_variance_(std::move(start.noise_variance)) {
  CHECK(settings.rule != RuleKind::kPower && settings.population >= 2,
        "a population rule needs a population");
  if (settings.rule == RuleKind::kCmaEs) {
    cma_es_.emplace(CmaEsSettings{settings.population, settings.active, settings.rate_factor},
                    distribution_);
  }
}

bool PopulationRule::learn(const ToldRollout& told, int num_results_of_run) {
  best_.add(told.rated);
  generation_.push_back(told);
  if (generation_.size() < static_cast<std::size_t>(settings_.population)) return false;
  const bool has_weight =
      std::any_of(generation_.begin(), generation_.end(),
                  [](const ToldRollout& member) { return member.rated.reward > 0; });
  if (has_weight) update(num_results_of_run);
  generation_.clear();
  return has_weight;
}

void PopulationRule::update(int num_results_of_run) {
  std::sort(generation_.begin(), generation_.end(), [](const ToldRollout& a, const ToldRollout& b) {
    return a.rated.rollout < b.rated.rollout;
  });
  if (cma_es_) {
    std::vector<RatedRollout> rated;
    rated.reserve(generation_.size());
    for (ToldRollout& member : generation_) rated.push_back(std::move(member.rated));
    cma_es_->update(rated);
    distribution_ = cma_es_->distribution();
    return;
  }
  const std::vector<double> weights = settings_.rule == RuleKind::kPi2
                                          ? pi2_weights(generation_, settings_.eliteness)
                                          : cem_weights(generation_, settings_.elites);
  const double floor = std::max(minimum_noise_share(settings_, num_results_of_run), kLeastNoise);
  distribution_ = weighted_update(
      generation_, weights, distribution_,
      {settings_.covariance_learning_rate, settings_.noise_decay, floor * noise_variance_});
}

}  // namespace treeroll
