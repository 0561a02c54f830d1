#pragma once

#include <memory>

#include "learner/explore/minimum_noise.h"
#include "learner/explore/update_rule.h"

namespace treeroll::explore {

struct ExplorationSettings;

/// Black-box PoWER, section 3-2-3. The defaults are those of table 4-3.
struct PowerSettings {
  int first_update = 10;    ///< S_init, results of a layer before its first update
  int best_considered = 2;  ///< I, at most first_update
  MinimumNoise minimum_noise{};
  bool operator==(const PowerSettings&) const = default;
};

/// PoWER over the history of a layer: the first update at S_init results (at the first one if the
/// layer began with experience), then one after each. Holds I roll-outs. The next layer inherits
/// those, projected, and the noise of (3-15) over them, section 3-2-4.
std::unique_ptr<UpdateRule> make_rule(const PowerSettings& settings, LayerStart start);

void read_power(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
