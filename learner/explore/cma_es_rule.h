#pragma once

#include <memory>

#include "learner/explore/population_rule.h"

namespace treeroll::explore {

struct ExplorationSettings;

/// CMA-ES over the generations of a layer. There is no floor of the noise: it learns its step size.
struct CmaEsRuleSettings {
  GenerationSettings generation{.population = 12};
  bool active = true;      ///< negative weights
  bool mirrored = true;    ///< draws come in pairs of opposite perturbations
  double rate_factor = 1;  ///< on the covariance's learning rates
  bool operator==(const CmaEsRuleSettings&) const = default;
};

std::unique_ptr<UpdateRule> make_rule(const CmaEsRuleSettings& settings, const LayerStart& start);

/// Also says, by `coordinates`, what the initial noise of the run comes from.
void read_cma_es(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
