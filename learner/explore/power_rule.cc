#include "learner/explore/power_rule.h"

#include <optional>
#include <string>
#include <utility>

#include "common/base/check.h"
#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/power_update.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {
namespace {

/// What is kept of a layer's history and compared at each result is bounded by this.
constexpr std::int64_t kMaxBestConsidered = 1'000;

class PowerRule final : public UpdateRule {
 public:
  PowerRule(const PowerSettings& settings, LayerStart start)
      : settings_(settings),
        distribution_(std::move(start.distribution)),
        noise_variance_(std::move(start.noise_variance)),
        history_(settings.best_considered),
        has_experience_(!start.experience.empty()) {
    CHECK(settings.best_considered <= settings.first_update, "I exceeds S_init");
    for (RatedRollout& rollout : start.experience) history_.add(std::move(rollout));
  }

  const SearchDistribution& distribution() const override { return distribution_; }

  bool learn(const ToldRollout& told, int num_results_of_run) override {
    ++num_results_;
    history_.add(told.rated);
    if (!has_experience_ && num_results_ < settings_.first_update) return false;
    std::optional<SearchDistribution> updated = power_update(
        history_.ranked(), distribution_.mean,
        minimum_noise_share(settings_.minimum_noise, num_results_of_run) * noise_variance_);
    if (!updated) return false;
    distribution_ = *std::move(updated);
    return true;
  }

  int first_update() const override { return settings_.first_update; }

  Inheritance inheritance(const LayerPassage& passage) const override {
    Inheritance given;
    given.experience = projected(passage.project, history_.ranked());
    if (given.experience.empty()) return given;
    std::optional<SearchDistribution> updated =
        power_update(given.experience, passage.start.distribution.mean,
                     minimum_noise_share(settings_.minimum_noise, passage.num_results_of_run) *
                         passage.start.noise_variance);
    if (updated) given.noise = std::move(updated->noise);
    return given;
  }

 private:
  PowerSettings settings_;
  SearchDistribution distribution_;
  Eigen::VectorXd noise_variance_;  // n x 1
  BestRollouts history_;
  bool has_experience_;
  std::int64_t num_results_ = 0;
};

}  // namespace

std::unique_ptr<UpdateRule> make_rule(const PowerSettings& settings, LayerStart start) {
  return std::make_unique<PowerRule>(settings, std::move(start));
}

void read_power(SettingsReader& exploration, ExplorationSettings& settings) {
  PowerSettings power;
  power.first_update = static_cast<int>(
      exploration.integer("first_update", 1, kMaxRollouts, power.first_update,
                          {.meaning = "S_init: results of a layer before its first "
                                      "update"}));
  power.best_considered = static_cast<int>(exploration.integer(
      "best_considered", 1, kMaxBestConsidered, power.best_considered,
      {.meaning = "I: the best roll-outs of a layer, of which mean and noise are "
                  "made; at most first_update"}));
  if (power.best_considered > power.first_update) {
    exploration.refuse("best_considered", "must be at most first_update, which is " +
                                              std::to_string(power.first_update));
  }
  power.minimum_noise = read_minimum_noise(exploration, power.minimum_noise);
  settings.rule = power;
}

}  // namespace treeroll::explore
