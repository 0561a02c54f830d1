#pragma once

namespace treeroll {
class SettingsReader;
}

namespace treeroll::explore {

/// The floor of a rule's exploration noise, thesis table 3-2, as a share of noise_variance.
struct MinimumNoise {
  double fraction = 5e-3;  ///< eps_noise; 0: no floor
  int decay_start = 0;     ///< n0; 0: no decay. After n > n0 results of the run the share is
  double decay_power = 1;  ///< multiplied by (n0 / n)^power
  bool operator==(const MinimumNoise&) const = default;
};

/// Reads the keys minimum_noise_*. What they do not say is as in `otherwise`; only where that has
/// no floor may there be none. Throws ConfigError.
MinimumNoise read_minimum_noise(SettingsReader& exploration, const MinimumNoise& otherwise);

/// Factor of the minimum noise after n results of the run: 1 up to n0, then (n0 / n)^power.
/// @param num_results  n, at least 1
double minimum_noise_decay(const MinimumNoise& minimum, int num_results);

/// Minimum noise as a share of noise_variance after n results of the run: eps_noise with its decay.
double minimum_noise_share(const MinimumNoise& minimum, int num_results);

}  // namespace treeroll::explore
