#include "learner/explore/update_rule.h"

#include <utility>

#include "learner/explore/population_rule.h"
#include "learner/explore/power_rule.h"

namespace treeroll {

std::unique_ptr<UpdateRule> make_update_rule(const ExplorationSettings& settings,
                                             LayerStart start) {
  if (settings.rule == RuleKind::kPower) {
    return std::make_unique<PowerRule>(settings, std::move(start));
  }
  return std::make_unique<PopulationRule>(settings, std::move(start));
}

}  // namespace treeroll
