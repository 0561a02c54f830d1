#pragma once

#include <Eigen/Core>

#include "common/policy/policy.h"

namespace treeroll::explore {

/// Which steps of theta count as equally long.
enum class Metric {
  kDiagonal,  ///< each element by the output that it moves alone
  kFull,      ///< every direction by the output that it moves
};

/// Size of a policy's outputs where it acts: their rms, the norm over the outputs; 0 for a start
/// from nothing.
double output_size(const PolicyEffect& effect);

/// Whether a policy gives any outputs to speak of.
bool does_something(const PolicyEffect& effect);

/// Covariance of steps of theta that move the output by 1 (rms over inputs, norm over outputs): in
/// each direction, or in each element. H = J^T J / N. Steps are bounded, never divided by what
/// moves nothing: an element in the output's unit counts as a tenth of the strongest at least, a
/// mean input as moving outputs of `scale` within half its deviation beside what it does move; and
/// no direction counts for less than a thousandth of the strongest.
/// @param scale  of the output, above 0
/// @return       n x n, symmetric positive definite
Eigen::MatrixXd step_covariance(const PolicyEffect& effect, Metric metric, double scale);

}  // namespace treeroll::explore
