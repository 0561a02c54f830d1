#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "learner/explore/update_rule.h"

namespace treeroll::explore {

/// A generation in which each pair of draws has a noise of its own, of LayerStart::of_scales: the
/// size of the output is not known, and its members tell it. The first draw is the mean.
class ScaleTrial {
 public:
  /// @param noises      n x n each, not empty; draws are made with the first
  /// @param population  draws of a generation
  ScaleTrial(const std::vector<Eigen::MatrixXd>& noises, int population);

  /// Normal numbers that the first noise makes of what the next draw's noise makes of `normal`.
  /// Called for each draw after the mean, in their order.
  Eigen::VectorXd next(const Eigen::VectorXd& normal);
  /// The largest noise of which a member earns some share of what the best one does, the mean
  /// included. Not the noise that gains most: a small one gains a little in any direction, a large
  /// one loses until the search has found the directions that matter, and finds them sooner.
  /// @param generation  its members, by number
  const Eigen::MatrixXd& best(std::span<const ToldRollout> generation) const;

 private:
  std::size_t noise_of(int draw) const;

  std::vector<Eigen::MatrixXd> noises_;
  std::vector<Eigen::MatrixXd> factors_;
  int population_;
  int num_drawn_ = 1;  // the mean
};

}  // namespace treeroll::explore
