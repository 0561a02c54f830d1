#pragma once

#include <string>

#include "common/policy/policy.h"

namespace treeroll::worker {

/// A policy to try a program with: one layer of equal Gaussians along the first input, whose
/// outputs lie on a line through all of them.
/// Precondition: input_dim and output_dim are above 0 and together at most kSampleDimMax.
/// @param num_gaussians  how many, and so how long its text is
/// @param slope          of the outputs, so that there are different policies
PolicyPtr sample_policy(int input_dim, int output_dim, int num_gaussians, double slope);

inline constexpr int kSampleDimMax = 32;

}  // namespace treeroll::worker
