#pragma once

#include <Eigen/Core>

#include "common/policy/gmm.h"

namespace treeroll {

/// Gaussian mixture regression prepared for many inputs: thesis, (A-9), (A-11).
/// Uses the portable elementary functions, so a policy gives the same bits everywhere.
class Gmr {
 public:
  explicit Gmr(const Gmm& gmm);

  int input_dim() const;
  int output_dim() const;

  /// Mean of the outputs given the input, (A-9).
  /// @param input   dI x 1, finite, in the units of the mixture
  /// @return        dO x 1. Far from every component the nearest one decides: never NaN.
  Eigen::VectorXd regress(const Eigen::Ref<const Eigen::VectorXd>& input) const;

  /// The same for one input and one output, without allocating: precondition dI = dO = 1.
  double regress(double input) const;

  /// Weights h_k(input), (A-11): K x 1, sum 1, by log-sum-exp.
  Eigen::VectorXd weights(const Eigen::Ref<const Eigen::VectorXd>& input) const;

 private:
  struct Prepared;
  // (the room decides)
};

}  // namespace treeroll
