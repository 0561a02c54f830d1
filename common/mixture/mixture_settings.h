#pragma once

#include <array>
#include <optional>

#include "common/mixture/gmm.h"

namespace treeroll {

class SettingsReader;

/// Reads a mixture that is given number by number. Does not call finish().
///
///   inputs = 1                          # dI
///   means = [[.25, 1], [.75, -1]]       # K rows: inputs, then outputs
///   deviations = [.25, .3]              # zeta, the diagonal of L (3-12): a row for all, or K rows
///   psi = [.3, -.3]                     # block of L, dI dO numbers, row by row: a row for all or
///                                       # K rows; 0 by default
///   priors = [.5, .5]                   # 1 / K by default
///
/// Instead of `means`, for one input: components at the middles of K equal parts of a range.
///   range = [0, 1]
///   outputs = [1, -1]                   # K rows of dO numbers
/// Instead of `deviations` and `psi`, any covariance:
///   covariances = [[.06, 0, .09], ...]  # lower triangle, row by row: a row for all, or K rows
///
/// Throws ConfigError.
/// @param range  taken where the table does not name one; without it, it must
Gmm read_mixture(SettingsReader& mixture, std::optional<std::array<double, 2>> range = {});

}  // namespace treeroll
