#pragma once

#include <memory>
#include <optional>

#include "learner/explore/population_rule.h"

namespace treeroll::explore {

struct ExplorationSettings;

/// CMA-ES over the generations of a layer. There is no floor of the noise: it learns its step size.
struct CmaEsRuleSettings {
  GenerationSettings generation{.population = 12};
  bool active = true;      ///< negative weights
  bool mirrored = true;    ///< draws come in pairs of opposite perturbations
  double rate_factor = 1;  ///< on the covariance's learning rates
  /// Tries LayerStart::bolder noise with its first generation, one member of which is the mean. If
  /// some member is far better than that, the start is far from good: the search stays bold, with
  /// these rates. Otherwise it begins again with the initial noise and `rate_factor`. Where the
  /// size of the output is not known (LayerStart::of_scales), that generation tries all of them,
  /// and either way the search goes on with the one that has proved best. From a start that is far
  /// from good LayerStart::systematic_steps are tried after one more generation: if they lead to
  /// far more than that has earned, the search begins again there, with `rate_factor`.
  std::optional<double> bold_rate_factor = {};
  bool operator==(const CmaEsRuleSettings&) const = default;
};

std::unique_ptr<UpdateRule> make_rule(const CmaEsRuleSettings& settings, const LayerStart& start);

/// Rule "auto": CMA-ES as it needs no tuning, with a first step that is tried. Has no keys.
void read_automatic(SettingsReader& exploration, ExplorationSettings& settings);

/// Also says, by `coordinates`, what the initial noise of the run comes from.
void read_cma_es(SettingsReader& exploration, ExplorationSettings& settings);

}  // namespace treeroll::explore
