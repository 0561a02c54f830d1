#include "learner/explore/cma_es_rule.h"

#include <optional>
#include <utility>
#include <vector>

#include "common/base/settings_reader.h"
#include "learner/explore/cma_es.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {
namespace {

class CmaEsRule final : public PopulationRule {
 public:
  CmaEsRule(const CmaEsRuleSettings& settings, const SearchDistribution& start)
      : PopulationRule(settings.generation, start),
        mirrored_(settings.mirrored),
        search_({settings.generation.population, settings.active, settings.rate_factor}, start) {}

  Eigen::VectorXd next_normal_numbers(RandomStream stream) override {
    if (to_mirror_) return -*std::exchange(to_mirror_, std::nullopt);
    Eigen::VectorXd normal = PopulationRule::next_normal_numbers(stream);
    if (mirrored_) to_mirror_ = normal;
    return normal;
  }

 private:
  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& /*before*/,
                             int /*num_results_of_run*/) override {
    std::vector<RatedRollout> rated;
    rated.reserve(generation.size());
    for (const ToldRollout& member : generation) rated.push_back(member.rated);
    search_.update(rated);
    return search_.distribution();
  }

  bool mirrored_;
  std::optional<Eigen::VectorXd> to_mirror_;  // of the last draw, if it has no mirror
  CmaEs search_;
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const CmaEsRuleSettings& settings, const LayerStart& start) {
  return std::make_unique<CmaEsRule>(settings, start.distribution);
}

void read_cma_es(SettingsReader& exploration, ExplorationSettings& settings) {
  CmaEsRuleSettings cma_es;
  cma_es.generation = read_generation(exploration, cma_es.generation.population);
  cma_es.active = exploration.boolean("active", cma_es.active);
  cma_es.mirrored = exploration.boolean("mirrored", cma_es.mirrored);
  cma_es.rate_factor =
      exploration.number("rate_factor", {.min = .01, .max = 100}, cma_es.rate_factor);
  settings.rule = cma_es;
  if (exploration.choice("coordinates", {"noise_variance", "sensitivity"}, "noise_variance") ==
      "sensitivity") {
    settings.initial_step = exploration.number("initial_step", kFactor, .03);
  }
}

}  // namespace treeroll::explore
