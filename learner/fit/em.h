#pragma once

#include <Eigen/Core>
#include <stdexcept>

#include "common/mixture/gmm.h"

namespace treeroll {

/// A fit that cannot be made from these data with these settings: says which component and why.
class FitError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Of a component that is responsible for no data.
class LeftWithoutData : public FitError {
 public:
  using FitError::FitError;
};

struct EmSettings {
  int num_iterations = 500;  ///< fewer are made once nothing changes any more
  Eigen::VectorXd
      regularisation;  ///< d x 1, not negative, added to the diagonal of each covariance
                       ///< in each M step; keeps it from collapsing onto a curve
};

/// Mixture to start EM from, thesis section 4-3-1: components equally spaced over the range of the
/// first input, each half its share of the range wide; other means 0, or in the middle of the data
/// where 0 is more than a thousand deviations from all of them; equal priors.
/// @param data              d x N, columns are observations
/// @param output_deviation  standard deviation in all dimensions but the first
/// Throws FitError if the first input does not vary.
Gmm equally_spaced(const Eigen::MatrixXd& data, int input_dim, int num_components,
                   double output_deviation);

/// Expectation maximisation, table 3-1 left.
/// @param start  as many components as the fit will have
/// @param data   d x N, columns are observations, finite but for outputs that are missing
///               (missing_outputs.h)
/// Throws FitError where a component is left without data or its covariance without an inverse;
/// no NaN comes out.
Gmm fit_em(const Gmm& start, const Eigen::MatrixXd& data, const EmSettings& settings);

/// Adapted expectation maximisation, table 3-1 right: children of one Gaussian fitted to its share
/// of the data.
/// @param start                  the children only
/// @param parent_responsibility  N x 1, P(parent | x_n), from 0 to 1
/// @return                       priors sum to the mean of parent_responsibility
Gmm fit_children(const Gmm& start, const Eigen::MatrixXd& data,
                 const Eigen::VectorXd& parent_responsibility, const EmSettings& settings);

/// P(k | x_n) among the components of `gmm`: K x N, each column sums to one.
Eigen::MatrixXd responsibilities(const Gmm& gmm, const Eigen::MatrixXd& data);

/// Mean over the data of log sum_k pi_k N(x_n | k): log-likelihood per sample.
double mean_log_likelihood(const Gmm& gmm, const Eigen::MatrixXd& data);

}  // namespace treeroll
