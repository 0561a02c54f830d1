#include "learner/explore/minimum_noise.h"

#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "learner/explore/setting_bounds.h"

namespace treeroll::explore {

MinimumNoise read_minimum_noise(SettingsReader& exploration, const MinimumNoise& otherwise) {
  constexpr NumberRule kFactorOrNone{.min = 0, .max = kFactor.max};
  MinimumNoise minimum;
  minimum.fraction = exploration.number(
      "minimum_noise_fraction", otherwise.fraction > 0 ? kFactor : kFactorOrNone,
      otherwise.fraction,
      {.meaning = "eps_noise: the noise stays above this share of noise_variance"});
  minimum.decay_start = static_cast<int>(exploration.integer(
      "minimum_noise_decay_start", 0, kMaxRollouts, otherwise.decay_start,
      {.meaning = "n0: after n > n0 results of the run the floor is multiplied by "
                  "(n0 / n)^power; 0: never"}));
  minimum.decay_power =
      exploration.number("minimum_noise_decay_power", {.min = 0, .max = 10, .min_allowed = false},
                         otherwise.decay_power, {.meaning = "That power"});
  return minimum;
}

double minimum_noise_decay(const MinimumNoise& minimum, int num_results) {
  const int start = minimum.decay_start;
  if (start == 0 || num_results <= start) return 1;
  // exp and log of elementary.h, since std::pow may differ from one C library to the next.
  const double ratio = static_cast<double>(start) / num_results;
  return elementary::exp(minimum.decay_power * elementary::log(ratio));
}

double minimum_noise_share(const MinimumNoise& minimum, int num_results) {
  return minimum.fraction * minimum_noise_decay(minimum, num_results);
}

}  // namespace treeroll::explore
