#pragma once

#include <memory>

#include "learner/explore/standard_update_rules.h"
#include "learner/explore/update_rule.h"

namespace treeroll::explore {

/// A rule that the learner does not know: a (1 + 1) evolution strategy. It moves to each better
/// roll-out with bolder noise and becomes more timid at each other one.
struct HillClimberSettings {
  double boldness = 1.5;  ///< factor on the deviations at a better roll-out, above 1
  bool operator==(const HillClimberSettings&) const = default;
};

std::unique_ptr<UpdateRule> make_rule(const HillClimberSettings& settings, LayerStart start);

void read_hill_climber(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
