#pragma once

#include <cstdint>
#include <span>

#include "learner/explore/update_rule.h"

namespace treeroll {

/// Black-box PoWER over the history of a layer, section 3-2-3: the first update at S_init results
/// (at the first one if the layer began with experience), then one after each. Holds I roll-outs.
class PowerRule final : public UpdateRule {
 public:
  PowerRule(const ExplorationSettings& settings, LayerStart start);

  const SearchDistribution& distribution() const override { return distribution_; }
  bool learn(const ToldRollout& told, int num_results_of_run) override;
  std::span<const RatedRollout> best() const override { return history_.ranked(); }

 private:
  ExplorationSettings settings_;
  SearchDistribution distribution_;
  Eigen::VectorXd noise_variance_;  // n x 1
  BestRollouts history_;
  bool has_experience_;
  std::int64_t num_results_ = 0;
};

}  // namespace treeroll
