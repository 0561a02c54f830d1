#pragma once

#include <optional>
#include <vector>

#include "common/policy/policy.h"

namespace treeroll {

class SettingsReader;

/// How the search distribution follows from results.
enum class RuleKind {
  kPower,  ///< black-box PoWER, thesis section 3-2-3
  kPi2,    ///< PI2-BB: reward-weighted averaging of a generation
  kCem,    ///< cross-entropy method
  kCmaEs,  ///< covariance matrix adaptation
};

/// Settings of one run's search: thesis table 3-2. The defaults are those of table 4-3. What
/// another rule than the run's says stays at its default.
struct ExplorationSettings {
  RuleKind rule = RuleKind::kPower;
  int num_rollouts = 200;  ///< N, the budget
  int in_flight = 1;       ///< draws ahead of applied results
  // Population rules.
  int population = 0;                    ///< lambda, results between updates; 0 with PoWER
  bool complete_generations = true;      ///< draws wait for their generation; false: stale members
  double eliteness = 10;                 ///< PI2-BB: h
  double covariance_learning_rate = .5;  ///< PI2-BB, CEM
  double noise_decay = 1;                ///< PI2-BB, CEM: factor on the noise at each update
  int elites = 5;                        ///< CEM
  bool active = true;                    ///< CMA-ES: negative weights
  bool mirrored = true;                  ///< CMA-ES: draws come in pairs of opposite perturbations
  double rate_factor = 1;                ///< CMA-ES: on the covariance's learning rates
  bool sensitivity_coordinates = false;  ///< CMA-ES: initial noise from sensitivity_scale(), not
                                         ///< from noise_variance
  double initial_step = .03;             ///< CMA-ES: its deviation in those coordinates
  // PoWER.
  int first_update = 10;         ///< S_init, results of a layer before its first update
  int best_considered = 2;       ///< I
  int convergence_window = 20;   ///< M
  double convergence_slope = 0;  ///< eps_conv, reward per roll-out
  /// Share of the layer's average gain a roll-out below which the gain of the last M counts as
  /// convergence; without it the slope decides.
  std::optional<double> convergence_gain;
  std::optional<double> stop_at_reward;  ///< the run ends with the first reward of at least this
  bool stop_on_convergence = false;      ///< the run ends when the last layer has converged
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

/// Reads the [exploration] table of a study for a given start policy (number of layers and of noise
/// variances). `num_rollouts` and `in_flight` are the study's and stay untouched.
/// `noise_variance` is required, as no default could suit every task; `last_layer` is the
/// policy's last by default, the rest as in ExplorationSettings.
/// Throws ConfigError. Does not call finish(): the caller does.
ExplorationSettings read_exploration_settings(SettingsReader& exploration, const Policy& start);

/// Factor of the minimum noise after n results of the run: 1 up to n0, then (n0 / n)^power.
/// @param num_results  n, at least 1
double minimum_noise_decay(const ExplorationSettings& settings, int num_results);

/// Minimum noise as a share of noise_variance after n results of the run: eps_noise with its decay.
double minimum_noise_share(const ExplorationSettings& settings, int num_results);

}  // namespace treeroll
