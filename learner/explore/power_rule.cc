#include "learner/explore/power_rule.h"

#include <optional>
#include <utility>

#include "learner/explore/power_update.h"

namespace treeroll {

PowerRule::PowerRule(const ExplorationSettings& settings, LayerStart start)
    : settings_(settings),
      distribution_(std::move(start.distribution)),
      noise_variance_(std::move(start.noise_variance)),
      history_(settings.best_considered),
      has_experience_(!start.experience.empty()) {
  for (RatedRollout& rollout : start.experience) history_.add(std::move(rollout));
}

bool PowerRule::learn(const ToldRollout& told, int num_results_of_run) {
  ++num_results_;
  history_.add(told.rated);
  if (!has_experience_ && num_results_ < settings_.first_update) return false;
  std::optional<SearchDistribution> updated =
      power_update(history_.ranked(), distribution_.mean,
                   minimum_noise_share(settings_, num_results_of_run) * noise_variance_);
  if (!updated) return false;
  distribution_ = *std::move(updated);
  return true;
}

}  // namespace treeroll
