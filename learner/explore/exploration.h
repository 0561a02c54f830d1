#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/rollout_status.h"
#include "common/policy/policy.h"

namespace treeroll {

/// Settings of one run's search: thesis table 3-2.
struct ExplorationSettings {
  int num_rollouts = 200;        ///< N, the budget
  int in_flight = 1;             ///< draws ahead of applied results
  int first_update = 10;         ///< S_init
  int best_considered = 5;       ///< I
  int convergence_window = 20;   ///< M
  double convergence_slope = 0;  ///< eps_conv, reward per roll-out
  std::vector<double>
      noise_variance;  ///< diag of Sigma_noise for one component (theta_dim_per_component)
  double initial_noise_factor = 1;       ///< gamma: initial noise = gamma * noise_variance
  double minimum_noise_fraction = 1e-2;  ///< eps_noise: minimum noise = eps_noise * noise_variance
  int minimum_noise_decay_start = 0;     ///< n0; 0: no decay. After n > n0 results of the run the
  double minimum_noise_decay_power = 1;  ///< minimum noise is multiplied by (n0 / n)^power
  int first_layer = 1;                   ///< explored first
  int last_layer = 1;                    ///< explored to the end of the budget
  bool operator==(const ExplorationSettings&) const = default;
};

/// A roll-out to be made.
struct Draw {
  int rollout = 0;        ///< 0 .. N-1
  int layer = 0;          ///< drawn at
  Eigen::VectorXd theta;  ///< perturbed parameters, for policy(layer)
};

/// One run: algorithm 2 of the thesis as ask and tell. A pure function of its settings, start,
/// seed, repetition and the results told, in the order they are told.
class Exploration {
 public:
  Exploration(ExplorationSettings settings, TreeModel start, ThetaLayout layout, std::uint64_t seed,
              std::uint32_t repetition);

  /// The next roll-out in number order, or none until more results have been told.
  std::optional<Draw> ask();
  /// Applies the result of a roll-out that was asked for and not told before. Failed: reward 0.
  void tell(int rollout, double reward, RolloutStatus status);

  bool done() const;  ///< all N results have been told
  int num_told() const;
  int layer() const;  ///< being explored
  /// Tree as it was when `layer` began to be explored, with that layer: what theta~ refers to.
  /// Precondition: the layer has begun.
  const Policy& policy(int layer) const;
  /// Current mean parameters of layer().
  const Eigen::VectorXd& mean() const;
  const Eigen::MatrixXd& noise() const;

  struct Best {
    int rollout = -1;  ///< -1 before the first result
    int layer = 0;
    double reward = 0;
    Eigen::VectorXd theta;
  };
  const Best& best() const;
  /// Roll-outs after whose result the run went on to the next layer.
  const std::vector<int>& switches() const;
  /// Slope and mean of the rewards in the convergence window of this layer; nothing before two.
  std::optional<double> reward_slope() const;

 private:
  // (the room decides)
};

}  // namespace treeroll
