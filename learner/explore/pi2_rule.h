#pragma once

#include <memory>

#include "learner/explore/generation_noise.h"
#include "learner/explore/population_rule.h"

namespace treeroll::explore {

struct ExplorationSettings;

/// PI2-BB: reward-weighted averaging of a generation.
struct Pi2Settings {
  GenerationSettings generation{};
  double eliteness = 10;  ///< h, above 0
  GenerationNoise noise{};
  bool operator==(const Pi2Settings&) const = default;
};

std::unique_ptr<UpdateRule> make_rule(const Pi2Settings& settings, LayerStart start);

void read_pi2(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
