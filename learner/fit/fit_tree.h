#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "common/policy/tree/tree_model.h"
#include "learner/fit/em.h"
#include "learner/fit/regression_fit.h"
#include "learner/fit/split.h"

namespace treeroll {

/// Where EM starts.
enum class FitStart {
  kEquallySpaced,  ///< over the range of the first input, thesis section 4-3-1
  kKmeans,         ///< the clusters of k-means
};

/// How a model is fitted to a demonstration.
struct FitSettings {
  FrameKind frame_kind = FrameKind::kEigenvector;
  int input_dim = 1;
  EmSettings em;
  FitStart start = FitStart::kEquallySpaced;
  double initial_output_deviation = 5;  ///< zeta_2, of equally spaced components EM starts from
  std::uint64_t kmeans_seed = 1;
  SplitSettings split;  ///< bottom-up trees only
  /// How EM's mixtures are refined, so that their regression meets the data; empty: they are not.
  std::optional<RegressionSettings> refine;
};

/// A tree of one layer: plain EM from the start the settings name, refined if they say so: then in
/// the order of the first input. Throws FitError.
/// @param data  d x N, columns are observations
TreeModel fit_flat(const Eigen::MatrixXd& data, int num_components, const FitSettings& settings);

/// Coarse to fine, thesis section 3-1: layer 1 as fit_flat, then each Gaussian is split in two and
/// the children are fitted to the data of their parent. Child 2k and 2k + 1 belong to parent k.
/// The fits of a layer weigh a sample by P(parent | x_n) down the whole chain of ancestors; so does
/// the refinement of each pair.
TreeModel fit_bottom_up(const Eigen::MatrixXd& data, int num_components_layer_1, int num_layers,
                        const FitSettings& settings);

/// Fine to coarse, proposed in thesis section 3-3: the finest layer as fit_flat, in the order of
/// the first input; each layer above merges neighbours pairwise by moments. Precondition:
/// num_components_finest is divisible by 2^(num_layers - 1).
TreeModel fit_top_down(const Eigen::MatrixXd& data, int num_components_finest, int num_layers,
                       const FitSettings& settings);

}  // namespace treeroll
