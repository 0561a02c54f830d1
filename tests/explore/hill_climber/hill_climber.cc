#include "tests/explore/hill_climber/hill_climber.h"

#include <cmath>
#include <utility>

#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"

namespace treeroll::explore {
namespace {

class HillClimber final : public UpdateRule {
 public:
  HillClimber(const HillClimberSettings& settings, SearchDistribution start)
      : boldness_(settings.boldness), distribution_(std::move(start)) {}

  const SearchDistribution& distribution() const override { return distribution_; }

  bool learn(const ToldRollout& told, int /*num_results_of_run*/) override {
    if (told.rated.reward > best_reward_) {
      best_reward_ = told.rated.reward;
      distribution_.mean = told.rated.theta;
      distribution_.noise *= boldness_ * boldness_;
    } else {
      distribution_.noise /= std::sqrt(boldness_);  // In balance at one success in five.
    }
    return true;
  }

  int first_update() const override { return 1; }

 private:
  double boldness_;
  SearchDistribution distribution_;
  double best_reward_ = -1;
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const HillClimberSettings& settings, LayerStart start) {
  return std::make_unique<HillClimber>(settings, std::move(start.distribution));
}

void read_hill_climber(SettingsReader& exploration, ExplorationSettings& settings) {
  HillClimberSettings own;
  own.boldness =
      exploration.number("boldness", {.min = 1, .max = 10, .min_allowed = false}, own.boldness);
  settings.rule = own;
}

}  // namespace treeroll::explore
