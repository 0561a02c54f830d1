#pragma once

#include <cstdint>

#include "common/mixture/gmm.h"
#include "learner/fit/em.h"

namespace treeroll {

/// Mixture to start EM from by k-means: priors, means and covariances of the clusters, in the order
/// of the first input. Distances are taken in units of each row's standard deviation. The centres
/// start at observations drawn far from each other (k-means++), a pure function of `seed`; a
/// cluster that loses its data begins again at the observation farthest from its centre.
/// @param data            d x N, columns are observations, finite
/// @param regularisation  d x 1, added to the diagonal of each covariance
/// Throws FitError if there are fewer different observations than components, or a row does not
/// vary, unless it is an output with a regularisation.
Gmm kmeans(const Eigen::MatrixXd& data, int input_dim, int num_components, std::uint64_t seed,
           const Eigen::VectorXd& regularisation);

}  // namespace treeroll
