#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "common/numbers/random_stream.h"
#include "learner/explore/best_rollouts.h"
#include "learner/explore/layer_start.h"
#include "learner/explore/search_distribution.h"

namespace treeroll::explore {

/// A result of the layer being explored, with what theta~ was drawn from: with several roll-outs in
/// flight that is not always the distribution as it stands.
struct ToldRollout {
  RatedRollout rated;
  std::shared_ptr<const SearchDistribution> drawn_from;
};

/// How the search distribution of one layer follows from its results: thesis algorithm 2, line 9,
/// and rules of other authors in its place. Made anew at each switch; what a rule has collected by
/// then and not learnt from, a partial generation, goes with it. A pure function of its start and
/// of what it is asked and told, in that order. Who asks is LayerSearch and the switch.
class UpdateRule {
 public:
  virtual ~UpdateRule() = default;

  /// What the next roll-out is drawn from. Stays valid until learn().
  virtual const SearchDistribution& distribution() const = 0;
  /// @param num_results_of_run  results applied in this run, this one included
  /// @return                    whether the distribution has changed
  virtual bool learn(const ToldRollout& told, int num_results_of_run) = 0;

  /// Results of the layer that the first update takes: without it nothing counts as convergence.
  virtual int first_update() const = 0;
  /// Whether the results that are told now are of a trial of sizes or of systematic steps: their
  /// rewards rise and fall with these, so convergence is not judged by them.
  virtual bool is_trial() const { return false; }
  /// Whether another roll-out may be drawn before more results have been told.
  /// @param num_drawn  roll-outs of this layer drawn so far
  virtual bool may_draw(std::int64_t /*num_drawn*/) const { return true; }
  /// The standard normal numbers that the next theta~ comes from, one for each element of theta.
  /// Called once a draw, in the order of the draws.
  virtual Eigen::VectorXd next_normal_numbers(RandomStream stream);

  /// Theta of this layer from whose policy the next layer goes on if it reuses experience.
  virtual Eigen::VectorXd carried_theta() const { return distribution().mean; }
  /// What this layer gives to the next one if that reuses experience. Nothing unless a rule says
  /// so: the next layer then starts with the initial noise.
  virtual Inheritance inheritance(const LayerPassage& /*passage*/) const { return {}; }
};

}  // namespace treeroll::explore
