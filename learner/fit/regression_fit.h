#pragma once

#include <Eigen/Core>

#include "common/mixture/gmm.h"
#include "learner/fit/em.h"
#include "learner/fit/levenberg_marquardt.h"

namespace treeroll {

/// Refines a mixture so that its regression meets the data: EM maximises a density, which is
/// another thing. Levenberg-Marquardt over the input means, the output means, psi (3-12), the
/// Cholesky factor of S_II with the logarithm of its diagonal, and the logarithm of the priors, of
/// all components together. The diagonal of that factor (of one input: its deviation) stays within
/// 1/70 and 1.4 of the range of its input.
/// The variance of the outputs around the lines stays: a regression does not depend on it. A sum
/// of the priors stays too.
/// @param start  a fit of EM. Throws FitError where a component has no weight
/// @param data   d x N, columns are observations, finite but for outputs that are missing
Gmm refine_regression(const Gmm& start, const Eigen::MatrixXd& data,
                      const RegressionSettings& settings);

/// relative_rms() of over the data.
double relative_regression_error(const Gmm& gmm, const Eigen::MatrixXd& data);

}  // namespace treeroll
