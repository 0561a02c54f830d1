#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/policy/theta_layout.h"
#include "common/policy/tree_model.h"
#include "learner/fit/csv_demonstration.h"

namespace treeroll {

class SettingsReader;

/// A policy before exploration.
struct StartPolicy {
  TreeModel tree;
  ThetaLayout layout = ThetaLayout::kMeansCholesky;
  /// Of a fit: log-likelihood per sample of the demonstration, layer by layer, coarse to fine.
  std::vector<double> log_likelihoods = {};
  /// What it was fitted to: d x N, columns are observations; null for one that was given.
  std::shared_ptr<const Eigen::MatrixXd> demonstration = {};
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
///   [policy.demonstration]         # (4-5), or CSV files: see demonstration_settings.h
///   [policy.fit]
///   iterations = 500
///   regularisation = [1e-3, 1]     # variances added in each M step: s^2, (m/s^2)^2
///   start = "equally_spaced"       # components over the first input; or "kmeans"
///   kmeans_seed = 1                # of "kmeans"
///   initial_output_deviation = 5   # of "equally_spaced": zeta_2 of the components EM starts from,
///   m/s^2 split_axis = "cholesky"        # or "principal"
///
/// With start = "components" there is no demonstration and no fit; the layers stand as
/// component_layers.h says, and model is "tree", or "flat" for the finest layer alone.
/// @param read_file  gives the files of a demonstration; without it there are none
StartPolicy read_start_policy(SettingsReader& policy, const FileReader& read_file = {});

}  // namespace treeroll
