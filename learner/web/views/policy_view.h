#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "common/policy/policy.h"

namespace treeroll::web {

/// What a page draws of a policy, layer by layer: Gaussians as {mean, covariance} over [input;
/// output], and for a policy of one input what each layer alone would do over it.
///   {"input_dim", "output_dim", "layer", "kind", "low", "high",
///    "layers": [{"gaussians": [{"mean", "covariance"}], "left_out", "inputs", "outputs"}]}
nlohmann::json policy_view(const Policy& policy);

/// Policies drawn from a search distribution, what would be explored next: the same draws at each
/// look, so that only the noise moves the picture.
/// @param policy  of the layer that theta is of
/// @return        {"inputs", "draws": [[outputs], ..]}; no draws for several inputs
nlohmann::json noise_view(const Policy& policy, const Eigen::VectorXd& mean,
                          const Eigen::MatrixXd& noise);

/// Observations of a demonstration, at most some hundreds, equally spaced: by row of `samples`.
nlohmann::json samples_view(const Eigen::MatrixXd& samples);

}  // namespace treeroll::web
