#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "learner/report/figures/plot.h"

namespace treeroll::report {

/// A policy that learning begins with.
struct StartModel {
  std::vector<std::string> conditions;  ///< that begin with it
  PolicyPtr policy;
  /// What it was fitted to: d x N, columns are observations; null for one that was given.
  std::shared_ptr<const Eigen::MatrixXd> demonstration;
  std::vector<double> log_likelihoods = {};  ///< per sample, by layer; empty without a fit
  std::vector<std::string> columns = {};     ///< of inputs, then outputs: names_of()
};

/// Start policies layer by layer, as figures 3-1 and 4-17 of the thesis draw them: the
/// demonstration's samples, the Gaussians of the layer as ellipses of two standard deviations, its
/// regression; a row of panels an output, from the coarse layer to the fine one. Policies of
/// several inputs are left out.
std::vector<Plot> layer_plots(const std::string& study, const std::vector<StartModel>& starts);

}  // namespace treeroll::report
