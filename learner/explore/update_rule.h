#pragma once

#include <memory>
#include <span>

#include "learner/explore/best_rollouts.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/layer_start.h"
#include "learner/explore/search_distribution.h"

namespace treeroll {

/// A result of the layer being explored, with what theta~ was drawn from: with several roll-outs in
/// flight that is not always the distribution as it stands.
struct ToldRollout {
  RatedRollout rated;
  std::shared_ptr<const SearchDistribution> drawn_from;
};

/// How the search distribution of one layer follows from its results: thesis algorithm 2, line 9,
/// and rules of other authors in its place. Made anew at each switch. A pure function of its start
/// and of what it is told, in that order.
class UpdateRule {
 public:
  virtual ~UpdateRule() = default;

  /// What the next roll-out is drawn from. Stays valid until learn().
  virtual const SearchDistribution& distribution() const = 0;
  /// @param num_results_of_run  results applied in this run, this one included
  /// @return                    whether the distribution has changed
  virtual bool learn(const ToldRollout& told, int num_results_of_run) = 0;
  /// The best roll-outs that a next layer may build on, best first; empty if it knows none.
  virtual std::span<const RatedRollout> best() const = 0;
};

/// The rule of the settings, at the start of a layer.
std::unique_ptr<UpdateRule> make_update_rule(const ExplorationSettings& settings, LayerStart start);

}  // namespace treeroll
