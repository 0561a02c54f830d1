#pragma once

#include <optional>
#include <span>
#include <vector>

#include "learner/explore/cma_es.h"
#include "learner/explore/update_rule.h"

namespace treeroll {

/// Rules that update once for each generation of lambda results, in the order of application:
/// PI2-BB, CEM and CMA-ES. A generation is learnt in the order of its numbers, so that within it
/// the order of arrival does not count; one in which every reward is 0 teaches nothing. Holds at
/// most a generation and the best roll-out.
class PopulationRule final : public UpdateRule {
 public:
  PopulationRule(const ExplorationSettings& settings, LayerStart start);

  const SearchDistribution& distribution() const override { return distribution_; }
  bool learn(const ToldRollout& told, int num_results_of_run) override;
  std::span<const RatedRollout> best() const override { return best_.ranked(); }

 private:
  void update(int num_results_of_run);

  ExplorationSettings settings_;
  SearchDistribution distribution_;
  Eigen::VectorXd noise_variance_;  // n x 1
  std::optional<CmaEs> cma_es_;     // if that is the rule
  std::vector<ToldRollout> generation_;
  BestRollouts best_{1};
};

}  // namespace treeroll
