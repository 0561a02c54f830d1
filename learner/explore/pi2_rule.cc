#include "learner/explore/pi2_rule.h"

#include <utility>

#include "common/base/settings_reader.h"
#include "learner/explore/exploration_settings.h"

namespace treeroll::explore {
namespace {

class Pi2Rule final : public PopulationRule {
 public:
  Pi2Rule(const Pi2Settings& settings, LayerStart start)
      : PopulationRule(settings.generation, std::move(start.distribution)),
        settings_(settings),
        noise_variance_(std::move(start.noise_variance)) {}

 private:
  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& before, int num_results_of_run) override {
    return weighted_update(generation, pi2_weights(generation, settings_.eliteness), before,
                           noise_update(settings_.noise, num_results_of_run, noise_variance_));
  }

  Pi2Settings settings_;
  Eigen::VectorXd noise_variance_;  // n x 1
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const Pi2Settings& settings, LayerStart start) {
  return std::make_unique<Pi2Rule>(settings, std::move(start));
}

void read_pi2(SettingsReader& exploration, ExplorationSettings& settings) {
  Pi2Settings pi2;
  pi2.generation = read_generation(exploration, pi2.generation.population);
  pi2.eliteness =
      exploration.number("eliteness", {.min = 0, .max = 1000, .min_allowed = false}, pi2.eliteness);
  pi2.noise = read_generation_noise(exploration);
  settings.rule = pi2;
}

}  // namespace treeroll::explore
