#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "learner/explore/update_rule.h"

namespace treeroll {
class SettingsReader;
}

namespace treeroll::explore {

/// How results are collected into generations.
struct GenerationSettings {
  int population = 20;   ///< lambda, results between updates, at least 2
  bool complete = true;  ///< draws wait for their generation; false: stale members
  bool operator==(const GenerationSettings&) const = default;
};

/// Reads `population` and `generation`. Throws ConfigError.
GenerationSettings read_generation(SettingsReader& exploration, int population_otherwise);

/// Rules that update once for each generation of results, in the order of application: what they
/// have in common. A generation is learnt in the order of its numbers, so that within it the order
/// of arrival does not count; one in which every reward is 0 teaches nothing. Holds at most a
/// generation and the best roll-out. The next layer goes on from that, for the mean of a population
/// lags behind, and inherits the noise J S J^T, S the noise of this layer, J the projection's
/// derivative; no roll-outs.
class PopulationRule : public UpdateRule {
 public:
  PopulationRule(const GenerationSettings& settings, SearchDistribution start);

  const SearchDistribution& distribution() const final { return distribution_; }
  bool learn(const ToldRollout& told, int num_results_of_run) final;
  int first_update() const final { return settings_.population; }
  bool may_draw(std::int64_t num_drawn) const final;
  Eigen::VectorXd carried_theta() const final;
  Inheritance inheritance(const LayerPassage& passage) const final;

 protected:
  /// Whether the result that is told now is one of it.
  bool is_first_generation() const { return num_learnt_ == 0; }
  /// Of all results so far; 0 before the first.
  double best_reward() const;

 private:
  /// Members of the generation that is drawn now: lambda, but where a rule begins otherwise.
  virtual int generation_size() const { return settings_.population; }
  /// Whether a generation teaches something even if every reward is 0.
  virtual bool learns_from_nothing() const { return false; }
  /// The distribution after a generation.
  /// @param generation  its members, by number; some reward is above 0, or learns_from_nothing()
  /// @param before      distribution()
  virtual SearchDistribution updated(std::span<const ToldRollout> generation,
                                     const SearchDistribution& before, int num_results_of_run) = 0;

  GenerationSettings settings_;
  SearchDistribution distribution_;
  std::int64_t num_learnt_ = 0;  // results of whole generations
  std::vector<ToldRollout> generation_;
  BestRollouts best_{1};
};

}  // namespace treeroll::explore
