#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "learner/explore/best_rollouts.h"
#include "learner/explore/search_distribution.h"

namespace treeroll::explore {

struct CmaEsSettings {
  int population = 12;     ///< lambda, at least 2
  bool active = true;      ///< bad members take variance away along their steps
  double rate_factor = 1;  ///< on c_1 and c_mu; c_1 at most .5, c_mu 1 - c_1
};

/// CMA-ES with full covariance, as in Hansen, "The CMA Evolution Strategy: A Tutorial" (2016):
/// equation numbers below are that paper's. Beyond it: c_1 and c_mu times a factor; a member whose
/// Mahalanobis length exceeds sqrt(n) + 2 n / (n + 2) is clipped to it (a stale or foreign one);
/// members of equal reward share the weights of their ranks.
///
/// It works in z, theta = start + F z, F the Cholesky factor of the start noise: the search is the
/// same in every affine coordinate system, and its numbers have size 1. Only the ranks of the
/// rewards count.
class CmaEs {
 public:
  CmaEs(CmaEsSettings settings, const SearchDistribution& start);

  /// One generation. Members need not have been drawn from the distribution as it stands.
  /// @param generation  lambda members, theta finite
  void update(std::span<const RatedRollout> generation);

  SearchDistribution distribution() const;
  /// Weights of the ranks, best first, (49)..(53): the positive ones sum to 1.
  std::span<const double> weights() const { return weights_; }
  double c_1() const { return c_1_; }
  double c_mu() const { return c_mu_; }
  double step_size() const { return sigma_; }

 private:
  /// Members of equal reward get the mean of their weights.
  static void share_among_equals(std::span<const RatedRollout> ranked,
                                 std::vector<double>& weights);
  void decompose();

  Eigen::Index n_;
  Eigen::VectorXd origin_;  // of z, in theta
  Eigen::MatrixXd factor_;  // F
  std::vector<double> weights_;
  double mu_eff_ = 0;
  double c_sigma_ = 0;
  double d_sigma_ = 0;
  double c_c_ = 0;
  double c_1_ = 0;
  double c_mu_ = 0;
  double chi_n_ = 0;  // expected length of N(0, I)

  Eigen::VectorXd mean_;  // in z
  double sigma_ = 1;
  Eigen::MatrixXd covariance_;  // C, mean variance 1
  Eigen::MatrixXd whitening_;   // C^-1/2
  Eigen::VectorXd path_sigma_;
  Eigen::VectorXd path_c_;
  double path_sigma_start_share_ = 1;  // (1 - c_sigma)^(2 g)
};

}  // namespace treeroll::explore
