#include "learner/explore/exploration_settings.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "common/base/check.h"
#include "common/base/elementary.h"
#include "common/base/settings_reader.h"

namespace treeroll {
namespace {

// What is kept of a layer's history and compared at each result is bounded by these.
constexpr std::int64_t kMaxBestConsidered = 1'000;
constexpr std::int64_t kMaxConvergenceWindow = 100'000;
constexpr std::int64_t kMaxRollouts = 1'000'000'000;

// Wide enough for any unit, narrow enough that their products stay finite and above 0.
constexpr NumberRule kVariance{.min = 1e-30, .max = 1e30};
constexpr NumberRule kFactor{.min = 1e-12, .max = 1e12};
constexpr NumberRule kFactorOrNone{.min = 0, .max = 1e12};

constexpr std::int64_t kMaxPopulation = 100'000;

/// What reads the settings of a rule; keys of other rules are never asked for and so refused.
class Reader {
 public:
  Reader(SettingsReader& source, ExplorationSettings& settings)
      : source_(source), settings_(settings) {}

  void read_power() {
    integer("first_update", 1, kMaxRollouts, settings_.first_update);
    integer("best_considered", 1, kMaxBestConsidered, settings_.best_considered);
    if (settings_.best_considered > settings_.first_update) {
      source_.refuse("best_considered", "must be at most first_update, which is " +
                                            std::to_string(settings_.first_update));
    }
  }

  void read_population(int population) {
    settings_.population = population;
    integer("population", 2, kMaxPopulation, settings_.population);
    settings_.complete_generations =
        source_.choice("generation", {"complete", "stale"}, "complete") == "complete";
    switch (settings_.rule) {
      case RuleKind::kPi2:
        settings_.eliteness =
            source_.number("eliteness", {.min = 0, .max = 1000, .min_allowed = false}, 10);
        return read_noise_update();
      case RuleKind::kCem:
        settings_.elites = std::min(settings_.elites, settings_.population);
        integer("elites", 1, settings_.population, settings_.elites);
        return read_noise_update();
      case RuleKind::kCmaEs:
        return read_cma_es();
      case RuleKind::kPower:
        CHECK(false, "PoWER has no population");
    }
  }

  void read_convergence() {
    integer("convergence_window", 2, kMaxConvergenceWindow, settings_.convergence_window);
    settings_.convergence_slope =
        source_.number("convergence_slope", kAnyNumber, settings_.convergence_slope);
    // There is no number that stands for the slope: the key is absent, or a share.
    if (source_.has("convergence_gain")) {
      settings_.convergence_gain =
          source_.number("convergence_gain", {.min = 0, .max = 1, .min_allowed = false});
    }
    settings_.stop_on_convergence = source_.boolean("stop_on_convergence", false);
    settings_.stop_at_reward = source_.optional_number("stop_at_reward", kPositive);
  }

  void read_noise(std::size_t component_dim) {
    if (settings_.rule == RuleKind::kCmaEs && settings_.sensitivity_coordinates) {
      settings_.initial_step = source_.number("initial_step", kFactor, settings_.initial_step);
      return;
    }
    settings_.noise_variance =
        source_.numbers("noise_variance", kVariance, component_dim, component_dim);
    settings_.initial_noise_factor =
        source_.number("initial_noise_factor", kFactor, settings_.initial_noise_factor);
    if (settings_.rule == RuleKind::kCmaEs) return;  // It has no floor: it learns its step size.
    read_minimum_noise();
  }

  void read_layers(int num_layers) {
    settings_.reuse = source_.boolean("reuse", settings_.reuse);
    integer("first_layer", 1, num_layers, settings_.first_layer);
    settings_.last_layer = num_layers;
    integer("last_layer", 1, num_layers, settings_.last_layer);
    if (settings_.last_layer < settings_.first_layer) {
      source_.refuse("last_layer", "must be at least first_layer, which is " +
                                       std::to_string(settings_.first_layer));
    }
  }

 private:
  /// `value` is the default and takes the result.
  void integer(const char* key, std::int64_t min, std::int64_t max, int& value) {
    value = static_cast<int>(source_.integer(key, min, max, value));
  }

  void read_noise_update() {
    settings_.covariance_learning_rate =
        source_.number("covariance_learning_rate", {.min = 0, .max = 1, .min_allowed = false},
                       settings_.covariance_learning_rate);
    settings_.noise_decay = source_.number(
        "noise_decay", {.min = 0, .max = 1, .min_allowed = false}, settings_.noise_decay);
  }

  void read_cma_es() {
    settings_.active = source_.boolean("active", settings_.active);
    settings_.mirrored = source_.boolean("mirrored", settings_.mirrored);
    settings_.rate_factor = source_.number("rate_factor", {.min = .01, .max = 100}, 1);
    settings_.sensitivity_coordinates =
        source_.choice("coordinates", {"noise_variance", "sensitivity"}, "noise_variance") ==
        "sensitivity";
  }

  void read_minimum_noise() {
    // The generations of a population rule give the noise full rank by themselves: 0 is no floor.
    const bool may_be_none = settings_.rule != RuleKind::kPower;
    if (may_be_none) settings_.minimum_noise_fraction = 0;
    settings_.minimum_noise_fraction =
        source_.number("minimum_noise_fraction", may_be_none ? kFactorOrNone : kFactor,
                       settings_.minimum_noise_fraction);
    integer("minimum_noise_decay_start", 0, kMaxRollouts, settings_.minimum_noise_decay_start);
    settings_.minimum_noise_decay_power =
        source_.number("minimum_noise_decay_power", {.min = 0, .max = 10, .min_allowed = false},
                       settings_.minimum_noise_decay_power);
  }

  SettingsReader& source_;
  ExplorationSettings& settings_;
};

}  // namespace

ExplorationSettings read_exploration_settings(SettingsReader& exploration, const Policy& start) {
  ExplorationSettings settings;
  Reader reader(exploration, settings);
  const std::string rule = exploration.choice("rule", {"power", "pi2", "cem", "cma_es"}, "power");
  if (rule == "power") {
    reader.read_power();
  } else if (rule == "pi2") {
    settings.rule = RuleKind::kPi2;
    reader.read_population(20);
  } else if (rule == "cem") {
    settings.rule = RuleKind::kCem;
    reader.read_population(20);
  } else {
    settings.rule = RuleKind::kCmaEs;
    reader.read_population(12);
  }
  reader.read_convergence();
  reader.read_noise(static_cast<std::size_t>(start.noise_variance_dim()));
  reader.read_layers(start.num_layers());
  return settings;
}

double minimum_noise_decay(const ExplorationSettings& settings, int num_results) {
  const int start = settings.minimum_noise_decay_start;
  if (start == 0 || num_results <= start) return 1;
  // exp and log of elementary.h, since std::pow may differ from one C library to the next.
  const double ratio = static_cast<double>(start) / num_results;
  return elementary::exp(settings.minimum_noise_decay_power * elementary::log(ratio));
}

double minimum_noise_share(const ExplorationSettings& settings, int num_results) {
  return settings.minimum_noise_fraction * minimum_noise_decay(settings, num_results);
}

}  // namespace treeroll
