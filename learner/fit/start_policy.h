#pragma once

#include <functional>

#include "common/policy/policy_registry.h"

namespace treeroll {

class SettingsReader;
struct Demonstration;

/// Reads the [policy] table of a study and builds the tree it describes, to be explored at layer 1:
/// from a demonstration and a fit, or as given component by component. Throws ConfigError. Does not
/// call finish(): the caller does. Every key has a default; these are the thesis's swing-up
/// (section 4-3, table 4-3):
///
///   [policy]
///   model = "tree"                 # bottom-up; or "top_down_tree", or "flat"
///   components = [2, 4]            # a layer each, coarse to fine, doubling; flat uses the last
///   start = "fit"                  # or "components": see below
///   layout = "means_cholesky"      # what is explored: a name of kThetaLayoutNames
///   frames = "eigenvector"         # or "cholesky"
///   [policy.demonstration]         # (4-5), or CSV files: see demonstration_settings.h
///   [policy.fit]
///   iterations = 500
///   regularisation = [1e-3, 1]     # variances added in each M step: s^2, (m/s^2)^2
///   start = "equally_spaced"       # components over the first input; or "kmeans"
///   kmeans_seed = 1                # of "kmeans"
///   initial_output_deviation = 5   # of "equally_spaced", m/s^2: zeta_2 where EM starts
///   split_axis = "cholesky"        # or "principal"
///
/// With start = "components" there is no demonstration and no fit; the layers stand as
/// component_layers.h says, and model is "tree", or "flat" for the finest layer alone.
/// A fit that the sources have is taken as it is, if it is such a policy as the settings describe.
StartPolicy read_start_policy(SettingsReader& policy, const StartSources& sources = {});
/// The same, fitted to what `change` makes of the demonstration.
StartPolicy read_tree_start(SettingsReader& policy, const StartSources& sources,
                            const std::function<void(Demonstration&)>& change);

/// The standard kinds of policies, each with how a study starts it.
PolicyRegistry learnable_policies();

}  // namespace treeroll
