#include "learner/explore/pi2_rule.h"

#include <utility>

#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/weighted_rule.h"

namespace treeroll::explore {

std::unique_ptr<UpdateRule> make_rule(const Pi2Settings& settings, LayerStart start) {
  return make_weighted_rule(settings.generation, settings.noise, std::move(start),
                            [eliteness = settings.eliteness](std::span<const ToldRollout> members) {
                              return pi2_weights(members, eliteness);
                            });
}

void read_pi2(SettingsReader& exploration, ExplorationSettings& settings) {
  Pi2Settings pi2;
  pi2.generation = read_generation(exploration, pi2.generation.population);
  pi2.eliteness = exploration.number(
      "eliteness", {.min = 0, .max = 1000, .min_allowed = false}, pi2.eliteness,
      {.meaning = "h: how much better members of a generation outweigh the others"});
  pi2.noise = read_generation_noise(exploration);
  settings.rule = pi2;
}

}  // namespace treeroll::explore
