#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/policy/policy.h"
#include "learner/explore/best_rollouts.h"

namespace treeroll::explore {

/// What a demonstration may be wrong by as a whole, because it is another machine's or another
/// hand's: steps of theta that change the policy's outputs by
///
/// - a gain: .3 of what they are,
/// - an offset: .15 of each output's rms,
///
/// and, where there is one input, most often the time,
///
/// - a delay: .05 of the input's range,
/// - a tempo: the same at the end of the range, nothing at its beginning;
///
/// nearly as theta can in the mean square over the inputs of `effect`. What moves nothing (the
/// delay of a constant), or moves outputs as one before it does, is left out.
/// @param effect    of a policy that does something
/// @param boldness  above 0; a factor on all
/// @return          theta_dim() numbers each
std::vector<Eigen::VectorXd> systematic_steps(const PolicyEffect& effect, double boldness,
                                              int num_inputs);

/// A search along a few steps alone, both ways: a generation tries all from the best roll-out that
/// it has had, and the next one tries shorter steps. A pure function of what it is told.
class SystematicSearch {
 public:
  /// @param start  theta to begin at, and what it has earned
  /// @param steps  not empty
  SystematicSearch(RatedRollout start, const std::vector<Eigen::VectorXd>& steps);

  int generation_size() const { return static_cast<int>(steps_.size()); }
  /// theta of the next member of the generation.
  Eigen::VectorXd next();
  void learn(std::span<const RatedRollout> generation);
  bool is_over() const;
  const RatedRollout& best() const { return best_; }

 private:
  RatedRollout best_;
  std::vector<Eigen::VectorXd> steps_;
  std::size_t num_drawn_ = 0;  // of the generation
  int num_generations_ = 0;
};

}  // namespace treeroll::explore
