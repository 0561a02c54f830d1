#pragma once

#include <vector>

#include "common/policy/policy_registry.h"

namespace treeroll {

/// Reads the [policy] table of kind "spline", to be explored at layer 1:
///
///   kind = "spline"
///   degree = 3              # 0 to 7
///   coefficients = "auto"   # of an output: as few as meet the demonstration within a tenth of
///                           # its rms, of several recordings their mean; or of each layer, coarse
///                           # to fine: [4, 5, 7, 11], each with twice the spans of the one before
///   start = "fit"           # to [policy.demonstration]; or "constant", without one:
///   range = [0.0, 2.0]      # the inputs it is over
///   values = [0.0]          # what each output begins with
///
/// A constant start has [4, 5, 7, 11] coefficients by default. Throw ConfigError. Do not call
/// finish().
StartPolicy read_spline_start(SettingsReader& policy, const StartSources& sources);
/// Its constant start alone.
/// @param sizes  of the layers where the study names none
StartPolicy read_constant_spline(SettingsReader& policy, const std::vector<double>& sizes);

/// Of kind "correction", of a demonstration, which is what the start policy does:
///
///   kind = "correction"
///   degree = 3
///   coefficients = [8]      # as of a spline
///   [policy.demonstration]  # of one input that rises from sample to sample
StartPolicy read_correction_start(SettingsReader& policy, const StartSources& sources);

struct Demonstration;
/// Whether a correction can carry it: of one input that rises, not too long, no output missing.
bool can_be_corrected(const Demonstration& demonstration);

}  // namespace treeroll
