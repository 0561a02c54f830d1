#pragma once

#include <Eigen/Core>

#include "common/mixture/gmm.h"
#include "learner/fit/em.h"

namespace treeroll {

/// Relative error of a start that is close enough for learning: how many components or coefficients
/// it has goes by this where a study leaves that open.
inline constexpr double kSufficientError = .1;

/// When a regression is good enough.
struct RegressionSettings {
  /// Of the outputs' rms. To go on to the end makes components that cancel one another: the curve
  /// is met, and a search cannot use them.
  double stop_relative_error = .02;
  int num_steps = 200;
};

struct RegressionFit {
  Gmm gmm;
  /// rms of the regression's error, each output divided by its own rms over the data.
  double relative_error = 0;
};

/// Refines a mixture so that its regression meets the data: EM maximises a density, which is
/// another thing. Levenberg-Marquardt over the input means, the output means, psi (3-12), the
/// Cholesky factor of S_II with the logarithm of its diagonal, and the logarithm of the priors, of
/// all components together. The diagonal of that factor (of one input: its deviation) stays within
/// 1/70 and 1.4 of the range of its input.
/// The variance of the outputs around the lines stays: a regression does not depend on it. A sum
/// of the priors stays too.
/// @param start  a fit of EM. Throws FitError where a component has no weight
/// @param data   d x N, columns are observations, finite but for outputs that are missing
RegressionFit refine_regression(const Gmm& start, const Eigen::MatrixXd& data,
                                const RegressionSettings& settings);

/// rms of minus the outputs over the data, each output divided by its own rms (by 1 where
/// that is 0).
double relative_regression_error(const Gmm& gmm, const Eigen::MatrixXd& data);

}  // namespace treeroll
