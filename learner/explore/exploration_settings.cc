#include "learner/explore/exploration_settings.h"

#include <cstdint>
#include <string>

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

}  // namespace

ExplorationSettings read_exploration_settings(SettingsReader& exploration, const TreeModel& start,
                                              ThetaLayout layout) {
  ExplorationSettings settings;
  const auto integer = [&exploration](const char* key, std::int64_t min, std::int64_t max,
                                      int fallback) {
    return static_cast<int>(exploration.integer(key, min, max, fallback));
  };
  exploration.choice("rule", {"power"}, "power");

  settings.first_update = integer("first_update", 1, kMaxRollouts, settings.first_update);
  settings.best_considered =
      integer("best_considered", 1, kMaxBestConsidered, settings.best_considered);
  if (settings.best_considered > settings.first_update) {
    exploration.refuse("best_considered", "must be at most first_update, which is " +
                                              std::to_string(settings.first_update));
  }

  settings.convergence_window =
      integer("convergence_window", 2, kMaxConvergenceWindow, settings.convergence_window);
  settings.convergence_slope =
      exploration.number("convergence_slope", kAnyNumber, settings.convergence_slope);

  const Gmm coarsest = start.layer(1);
  const auto size = static_cast<std::size_t>(
      theta_dim_per_component(layout, coarsest.input_dim(), coarsest.output_dim()));
  settings.noise_variance = exploration.numbers("noise_variance", kVariance, size, size);
  settings.initial_noise_factor =
      exploration.number("initial_noise_factor", kFactor, settings.initial_noise_factor);
  settings.minimum_noise_fraction =
      exploration.number("minimum_noise_fraction", kFactor, settings.minimum_noise_fraction);
  settings.minimum_noise_decay_start =
      integer("minimum_noise_decay_start", 0, kMaxRollouts, settings.minimum_noise_decay_start);
  settings.minimum_noise_decay_power =
      exploration.number("minimum_noise_decay_power", {.min = 0, .max = 10, .min_allowed = false},
                         settings.minimum_noise_decay_power);

  settings.reuse = exploration.boolean("reuse", settings.reuse);
  const int num_layers = start.num_layers();
  settings.first_layer = integer("first_layer", 1, num_layers, 1);
  settings.last_layer = integer("last_layer", 1, num_layers, num_layers);
  if (settings.last_layer < settings.first_layer) {
    exploration.refuse("last_layer", "must be at least first_layer, which is " +
                                         std::to_string(settings.first_layer));
  }
  return settings;
}

double minimum_noise_decay(const ExplorationSettings& settings, int num_results) {
  const int start = settings.minimum_noise_decay_start;
  if (start == 0 || num_results <= start) return 1;
  // exp and log of elementary.h, since std::pow may differ from one C library to the next.
  const double ratio = static_cast<double>(start) / num_results;
  return elementary::exp(settings.minimum_noise_decay_power * elementary::log(ratio));
}

}  // namespace treeroll
