#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace treeroll::explore {

/// A perturbed theta and what it earned.
struct RatedRollout {
  int rollout = 0;
  double reward = 0;      ///< finite, not negative
  Eigen::VectorXd theta;  ///< as it was executed
};

/// True if `a` comes before `b` in w(i) of thesis (3-14): by descending reward, equal rewards by
/// ascending number, so that the order does not depend on the order of arrival.
bool ranks_before(const RatedRollout& a, const RatedRollout& b);

/// The best I roll-outs of a history of any length. Memory does not grow: what has once been
/// outdone by I others can never come back.
class BestRollouts {
 public:
  /// Precondition: capacity (I) is at least 1.
  explicit BestRollouts(int capacity);

  void add(RatedRollout rollout);
  /// w(1), w(2), ...: at most I, best first.
  std::span<const RatedRollout> ranked() const { return ranked_; }

 private:
  std::size_t capacity_;
  std::vector<RatedRollout> ranked_;
};

}  // namespace treeroll::explore
