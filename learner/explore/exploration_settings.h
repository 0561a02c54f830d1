#pragma once

#include <vector>

#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"

namespace treeroll {

class SettingsReader;

/// Settings of one run's search: thesis table 3-2. The defaults are those of table 4-3.
struct ExplorationSettings {
  int num_rollouts = 200;        ///< N, the budget
  int in_flight = 1;             ///< draws ahead of applied results
  int first_update = 10;         ///< S_init, results of a layer before its first update
  int best_considered = 2;       ///< I
  int convergence_window = 20;   ///< M
  double convergence_slope = 0;  ///< eps_conv, reward per roll-out
  std::vector<double>
      noise_variance;  ///< diag of Sigma_noise for one component (theta_dim_per_component)
  double initial_noise_factor = 1;       ///< gamma: initial noise = gamma * noise_variance
  double minimum_noise_fraction = 5e-3;  ///< eps_noise: minimum noise = eps_noise * noise_variance
  int minimum_noise_decay_start = 0;     ///< n0; 0: no decay. After n > n0 results of the run the
  double minimum_noise_decay_power = 1;  ///< minimum noise is multiplied by (n0 / n)^power
  bool reuse = true;    ///< the next layer begins with the experience of the one left
  int first_layer = 1;  ///< explored first
  int last_layer = 1;   ///< explored to the end of the budget
  bool operator==(const ExplorationSettings&) const = default;
};

/// Reads the [exploration] table of a study for a given start policy (number of layers, size of
/// theta for one component). `num_rollouts` and `in_flight` are the study's and stay untouched.
/// `noise_variance` is required, as no default could suit every task; `last_layer` is the tree's
/// last by default, the rest as in ExplorationSettings.
/// Throws ConfigError. Does not call finish(): the caller does.
ExplorationSettings read_exploration_settings(SettingsReader& exploration, const TreeModel& start,
                                              ThetaLayout layout);

/// Factor of the minimum noise after n results of the run: 1 up to n0, then (n0 / n)^power.
/// @param num_results  n, at least 1
double minimum_noise_decay(const ExplorationSettings& settings, int num_results);

}  // namespace treeroll
