#pragma once

#include <Eigen/Core>

#include "learner/explore/minimum_noise.h"
#include "learner/explore/weighted_update.h"

namespace treeroll::explore {

/// How the noise follows the generations of PI2-BB and CEM. Their members give the noise full rank
/// by themselves: there need be no floor.
struct GenerationNoise {
  double learning_rate = .5;  ///< covariance_learning_rate
  double decay = 1;           ///< factor on the noise at each update
  MinimumNoise minimum{.fraction = 0};
  bool operator==(const GenerationNoise&) const = default;
};

/// Throws ConfigError.
GenerationNoise read_generation_noise(SettingsReader& exploration);

/// For an update after n results of the run.
NoiseUpdate noise_update(const GenerationNoise& settings, int num_results,
                         const Eigen::VectorXd& noise_variance);

}  // namespace treeroll::explore
