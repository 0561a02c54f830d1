#include "learner/explore/cem_rule.h"

#include <algorithm>
#include <utility>

#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/weighted_rule.h"

namespace treeroll::explore {

std::unique_ptr<UpdateRule> make_rule(const CemSettings& settings, LayerStart start) {
  return make_weighted_rule(settings.generation, settings.noise, std::move(start),
                            [elites = settings.elites](std::span<const ToldRollout> members) {
                              return cem_weights(members, elites);
                            });
}

void read_cem(SettingsReader& exploration, ExplorationSettings& settings) {
  CemSettings cem;
  cem.generation = read_generation(exploration, cem.generation.population);
  const int population = cem.generation.population;
  cem.elites = static_cast<int>(exploration.integer(
      "elites", 1, population, std::min(cem.elites, population),
      {.meaning = "Members of a generation that the next distribution is made of",
       .rule = "1 to population"}));
  cem.noise = read_generation_noise(exploration);
  settings.rule = cem;
}

}  // namespace treeroll::explore
