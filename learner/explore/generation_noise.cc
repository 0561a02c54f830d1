#include "learner/explore/generation_noise.h"

#include <algorithm>

#include "common/settings/settings_reader.h"

namespace treeroll::explore {
namespace {

/// A noise without a floor stays above this share of noise_variance, 1e-10 of its deviations: far
/// below what any reward can tell, far above where its numbers would run out.
constexpr double kLeastNoise = 1e-20;

}  // namespace

GenerationNoise read_generation_noise(SettingsReader& exploration) {
  constexpr NumberRule kShare{.min = 0, .max = 1, .min_allowed = false};
  GenerationNoise noise;
  noise.learning_rate = exploration.number("covariance_learning_rate", kShare, noise.learning_rate,
                                           {.meaning = "How far the noise follows a generation"});
  noise.decay = exploration.number("noise_decay", kShare, noise.decay,
                                   {.meaning = "Factor on the noise at each update"});
  noise.minimum = read_minimum_noise(exploration, noise.minimum);
  return noise;
}

NoiseUpdate noise_update(const GenerationNoise& settings, int num_results,
                         const Eigen::VectorXd& noise_variance) {
  const double floor = std::max(minimum_noise_share(settings.minimum, num_results), kLeastNoise);
  return {settings.learning_rate, settings.decay, floor * noise_variance};
}

}  // namespace treeroll::explore
