#include "learner/explore/exploration_settings.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/settings_reader.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {
namespace {

/// What is compared at each result is bounded by this.
constexpr std::int64_t kMaxConvergenceWindow = 100'000;

/// Reads what every run has. The keys of rules that it does not have are never asked for and so
/// refused.
class Reader {
 public:
  Reader(SettingsReader& source, ExplorationSettings& settings)
      : source_(source), settings_(settings) {}

  void read_rule(std::span<const UpdateRuleKind> rules) {
    std::vector<std::string_view> names;
    for (const UpdateRuleKind& kind : rules) names.push_back(kind.name);
    const std::string name = source_.choice("rule", names, std::string(names.front()));
    const auto named = std::find(names.begin(), names.end(), name) - names.begin();
    rules[static_cast<std::size_t>(named)].read(source_, settings_);
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
    if (settings_.initial_step) return;  // The rule has said what the initial noise comes from.
    settings_.noise_variance =
        source_.numbers("noise_variance", kVariance, component_dim, component_dim);
    settings_.initial_noise_factor =
        source_.number("initial_noise_factor", kFactor, settings_.initial_noise_factor);
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

  SettingsReader& source_;
  ExplorationSettings& settings_;
};

}  // namespace

ExplorationSettings read_exploration_settings(SettingsReader& exploration, const Policy& start,
                                              std::span<const UpdateRuleKind> rules) {
  ExplorationSettings settings;
  Reader reader(exploration, settings);
  reader.read_rule(rules);
  reader.read_convergence();
  reader.read_noise(static_cast<std::size_t>(start.noise_variance_dim()));
  reader.read_layers(start.num_layers());
  return settings;
}

}  // namespace treeroll::explore
