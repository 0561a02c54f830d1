#pragma once

#include <memory>

#include "learner/explore/generation_noise.h"
#include "learner/explore/population_rule.h"

namespace treeroll::explore {

struct ExplorationSettings;

/// The cross-entropy method.
struct CemSettings {
  GenerationSettings generation{};
  int elites = 5;  ///< 1 to the population
  GenerationNoise noise{};
  bool operator==(const CemSettings&) const = default;
};

std::unique_ptr<UpdateRule> make_rule(const CemSettings& settings, LayerStart start);

void read_cem(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
