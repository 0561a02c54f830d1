#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/random_stream.h"
#include "learner/explore/best_rollouts.h"
#include "learner/explore/convergence.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/power_update.h"

namespace treeroll {

/// The search within one layer: lines 2 to 10 of thesis algorithm 2. Made anew at each switch, so
/// that noise and history start afresh. Holds I roll-outs and 2 M rewards, however long it runs.
class LayerSearch {
 public:
  /// @param theta  n x 1, where the search starts; n a multiple of noise_variance's size
  LayerSearch(const ExplorationSettings& settings, Eigen::VectorXd theta);

  /// Begins with the experience of the layer left, section 3-2-4: it is the history of (3-14) and
  /// (3-15), so that the first update follows the first result, and it shapes the noise until then.
  /// Without weight (no roll-out, or all of reward 0) it is the history and no more.
  /// Precondition: nothing has been drawn or learnt.
  /// @param experience  roll-outs in theta of this layer
  /// @param jacobian    of experience_jacobian(); nothing if there is none: the noise then stays
  void reuse(const ExplorationSettings& settings, std::vector<RatedRollout> experience,
             const std::optional<Eigen::MatrixXd>& jacobian, int num_results_of_run);

  const SearchDistribution& distribution() const { return distribution_; }
  /// The best I roll-outs that the updates of this layer look at.
  std::span<const RatedRollout> history() const { return history_.ranked(); }

  /// theta~ drawn from the distribution as it stands.
  Eigen::VectorXd draw(RandomStream stream);

  /// A result of this layer joins the history; from the S_init-th on an update follows.
  /// @param num_results_of_run  results applied in this run, this one included: n of the minimum
  ///                            noise's decay
  void learn(const ExplorationSettings& settings, RatedRollout rollout, int num_results_of_run);

  /// Enough results of this layer, max(M, S_init) + in_flight - 1, and the slope of the last M
  /// below eps_conv, (3-7). The in_flight - 1 allow for results drawn before the latest updates.
  bool has_converged(const ExplorationSettings& settings) const;

  std::optional<double> reward_slope() const { return window_.slope(); }
  std::optional<double> mean_reward() const { return window_.mean(); }

 private:
  Eigen::VectorXd minimum_noise(const ExplorationSettings& settings, int num_results_of_run) const;

  SearchDistribution distribution_;
  std::optional<Eigen::MatrixXd> factor_;  // of the noise, made when a draw needs it
  Eigen::VectorXd noise_variance_;         // n x 1, gamma = 1: (minimum noise) / eps_noise
  BestRollouts history_;
  RewardWindow window_;
  std::int64_t num_results_ = 0;
  bool has_experience_ = false;
};

}  // namespace treeroll
