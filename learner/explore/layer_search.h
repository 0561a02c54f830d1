#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "common/numbers/random_stream.h"
#include "learner/explore/convergence.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/layer_start.h"
#include "learner/explore/update_rule.h"

namespace treeroll::explore {

/// The search within one layer: lines 2 to 10 of thesis algorithm 2 around an update rule. Made
/// anew at each switch. Holds what its rule holds and a few times M rewards, however long it runs.
class LayerSearch {
 public:
  LayerSearch(const ExplorationSettings& settings, LayerStart start);

  const SearchDistribution& distribution() const { return *distribution_; }
  const UpdateRule& rule() const { return *rule_; }

  /// False while the rule waits for results.
  bool may_draw() const { return rule_->may_draw(num_drawn_); }
  struct Drawn {
    Eigen::VectorXd theta;  ///< theta~
    std::shared_ptr<const SearchDistribution> from;
  };
  /// theta~ drawn from the distribution as it stands. Precondition: may_draw().
  Drawn draw(RandomStream stream);

  /// A result of this layer.
  /// @param num_results_of_run  results applied in this run, this one included: n of the minimum
  ///                            noise's decay
  void learn(const ToldRollout& told, int num_results_of_run);

  /// Enough results of this layer, max(M, S_init) + in_flight - 1, and the slope of the last M
  /// below eps_conv, (3-7); with convergence_gain, their gain below that share of the layer's
  /// average instead. The in_flight - 1 allow for results drawn before the latest updates.
  /// S_init is the rule's first_update().
  bool has_converged(const ExplorationSettings& settings) const;

  std::optional<double> reward_slope() const { return window_.slope(); }
  std::optional<double> mean_reward() const { return window_.mean(); }

 private:
  std::unique_ptr<UpdateRule> rule_;
  std::shared_ptr<const SearchDistribution> distribution_;  // the rule's, for those drawn from it
  std::optional<Eigen::MatrixXd> factor_;  // of the noise, made when a draw needs it
  RewardWindow window_;
  std::optional<GainWindow> gains_;  // if convergence_gain asks for them
  std::int64_t num_drawn_ = 0;
  std::int64_t num_results_ = 0;
};

}  // namespace treeroll::explore
