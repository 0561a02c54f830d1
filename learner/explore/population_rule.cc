#include "learner/explore/population_rule.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/settings/settings_reader.h"

namespace treeroll::explore {
namespace {

constexpr std::int64_t kMaxPopulation = 100'000;

}  // namespace

GenerationSettings read_generation(SettingsReader& exploration, int population_otherwise) {
  GenerationSettings settings;
  settings.population =
      static_cast<int>(exploration.integer("population", 2, kMaxPopulation, population_otherwise,
                                           {.meaning = "lambda: results between two updates"}));
  settings.complete =
      exploration.choice(
          "generation", {"complete", "stale"}, "complete",
          {.meaning =
               "\"complete\": draws wait until their generation is in; \"stale\": results of "
               "older distributions count, and what is in flight stays in flight"}) == "complete";
  return settings;
}

PopulationRule::PopulationRule(const GenerationSettings& settings, SearchDistribution start)
    : settings_(settings), distribution_(std::move(start)) {
  CHECK(settings.population >= 2, "a population rule needs a population");
}

bool PopulationRule::learn(const ToldRollout& told, int num_results_of_run) {
  ++num_results_;
  best_.add(told.rated);
  generation_.push_back(told);
  if (generation_.size() < static_cast<std::size_t>(settings_.population)) return false;
  const bool has_weight =
      std::any_of(generation_.begin(), generation_.end(),
                  [](const ToldRollout& member) { return member.rated.reward > 0; });
  if (has_weight) {
    std::sort(generation_.begin(), generation_.end(),
              [](const ToldRollout& a, const ToldRollout& b) {
                return a.rated.rollout < b.rated.rollout;
              });
    distribution_ = updated(generation_, distribution_, num_results_of_run);
  }
  generation_.clear();
  return has_weight;
}

bool PopulationRule::may_draw(std::int64_t num_drawn) const {
  const std::int64_t population = settings_.population;
  return !settings_.complete || num_drawn < (num_results_ / population + 1) * population;
}

bool PopulationRule::has_reward() const {
  return !best_.ranked().empty() && best_.ranked().front().reward > 0;
}

Eigen::VectorXd PopulationRule::carried_theta() const {
  return has_reward() ? best_.ranked().front().theta : distribution_.mean;
}

Inheritance PopulationRule::inheritance(const LayerPassage& passage) const {
  Inheritance given;
  if (passage.jacobian && has_reward()) {
    given.noise = *passage.jacobian * distribution_.noise * passage.jacobian->transpose();
  }
  return given;
}

}  // namespace treeroll::explore
