#pragma once

#include "common/policy/linear/bspline.h"
#include "common/policy/policy_registry.h"

namespace treeroll {

/// Coefficients whose curve is nearest to the data: argmin |Phi c - u|^2, with a billionth of its
/// mean square for those that no sample sees.
/// @param data  (1 + dO) x N, inputs over outputs
/// @return      dO x spline.size()
Eigen::MatrixXd fit_spline(const BSpline& spline, const Eigen::MatrixXd& data);

/// Reads the [policy] table of kind "spline", to be explored at layer 1:
///
///   kind = "spline"
///   degree = 3              # 0 to 7
///   coefficients = "auto"   # of an output: as few as meet the demonstration within a tenth of
///                           # its rms; or of each layer, coarse to fine: [4, 5, 7, 11], each
///                           # with twice the spans of the one before
///   start = "fit"           # to [policy.demonstration]; or "constant", without one:
///   range = [0.0, 2.0]      # the inputs it is over
///   values = [0.0]          # what each output begins with
///
/// A constant start has [4, 5, 7, 11] coefficients by default. Throw ConfigError. Do not call
/// finish().
StartPolicy read_spline_start(SettingsReader& policy, const StartSources& sources);

/// Of kind "correction", of a demonstration, which is what the start policy does:
///
///   kind = "correction"
///   degree = 3
///   coefficients = [8]      # as of a spline
///   [policy.demonstration]  # of one input that rises from sample to sample
StartPolicy read_correction_start(SettingsReader& policy, const StartSources& sources);

}  // namespace treeroll
