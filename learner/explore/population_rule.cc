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
  best_.add(told.rated);
  generation_.push_back(told);
  const int size = generation_size();
  if (generation_.size() < static_cast<std::size_t>(size)) return false;
  num_learnt_ += size;
  const bool teaches = learns_from_nothing() || std::any_of(generation_.begin(), generation_.end(),
                                                            [](const ToldRollout& member) {
                                                              return member.rated.reward > 0;
                                                            });
  if (teaches) {
    std::sort(generation_.begin(), generation_.end(),
              [](const ToldRollout& a, const ToldRollout& b) {
                return a.rated.rollout < b.rated.rollout;
              });
    distribution_ = updated(generation_, distribution_, num_results_of_run);
  }
  generation_.clear();
  return teaches;
}

bool PopulationRule::may_draw(std::int64_t num_drawn) const {
  return !settings_.complete || num_drawn < num_learnt_ + generation_size();
}

double PopulationRule::best_reward() const {
  return best_.ranked().empty() ? 0 : best_.ranked().front().reward;
}

Eigen::VectorXd PopulationRule::carried_theta() const {
  return best_reward() > 0 ? best_.ranked().front().theta : distribution_.mean;
}

Inheritance PopulationRule::inheritance(const LayerPassage& passage) const {
  Inheritance given;
  if (passage.jacobian && best_reward() > 0) {
    given.noise = *passage.jacobian * distribution_.noise * passage.jacobian->transpose();
  }
  return given;
}

}  // namespace treeroll::explore
