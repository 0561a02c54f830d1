#pragma once

#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"

namespace treeroll {

class SettingsReader;

/// A policy before exploration.
struct StartPolicy {
  TreeModel tree;
  ThetaLayout layout = ThetaLayout::kMeansCholesky;
};

/// Reads the [policy] table of a study and builds the policy it describes: from a demonstration,
/// a fit and a tree, or as given component by component. Throws ConfigError. Does not call
/// finish(): the caller does. Every key has a default; these are the thesis's swing-up (section
/// 4-3, table 4-3):
///
///   [policy]
///   model = "tree"                 # bottom-up; or "top_down_tree", or "flat"
///   components = [2, 4]            # a layer each, coarse to fine, doubling; flat uses the last
///   start = "fit"                  # or "components": see below
///   layout = "means_cholesky"      # what is explored: a name of kThetaLayoutNames
///   frames = "eigenvector"         # or "cholesky"
///   [policy.demonstration]
///   kind = "cart_acceleration"     # (4-5): time in s -> acceleration of the cart in m/s^2
///   duration_s = 2.2
///   samples = 200
///   p = [-0.106, -0.185, 0.092, 0.134]
///   [policy.fit]
///   iterations = 500
///   regularisation = [1e-3, 1]     # variances added in each M step: s^2, (m/s^2)^2
///   initial_output_deviation = 5   # zeta_2 of the components EM starts from, m/s^2
///   split_axis = "cholesky"        # or "principal"
///
/// With start = "components" there is no demonstration and no fit; the layers stand as
/// component_layers.h says, and model is "tree", or "flat" for the finest layer alone.
StartPolicy read_start_policy(SettingsReader& policy);

}  // namespace treeroll
