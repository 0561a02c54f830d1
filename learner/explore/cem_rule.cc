#include "learner/explore/cem_rule.h"

#include <algorithm>
#include <utility>

#include "common/base/settings_reader.h"
#include "learner/explore/exploration_settings.h"

namespace treeroll::explore {
namespace {

class CemRule final : public PopulationRule {
 public:
  CemRule(const CemSettings& settings, LayerStart start)
      : PopulationRule(settings.generation, std::move(start.distribution)),
        settings_(settings),
        noise_variance_(std::move(start.noise_variance)) {}

 private:
  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& before, int num_results_of_run) override {
    return weighted_update(generation, cem_weights(generation, settings_.elites), before,
                           noise_update(settings_.noise, num_results_of_run, noise_variance_));
  }

  CemSettings settings_;
  Eigen::VectorXd noise_variance_;  // n x 1
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const CemSettings& settings, LayerStart start) {
  return std::make_unique<CemRule>(settings, std::move(start));
}

void read_cem(SettingsReader& exploration, ExplorationSettings& settings) {
  CemSettings cem;
  cem.generation = read_generation(exploration, cem.generation.population);
  const int population = cem.generation.population;
  cem.elites = static_cast<int>(
      exploration.integer("elites", 1, population, std::min(cem.elites, population)));
  cem.noise = read_generation_noise(exploration);
  settings.rule = cem;
}

}  // namespace treeroll::explore
