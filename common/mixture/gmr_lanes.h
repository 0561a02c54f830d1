#pragma once

#include "common/mixture/gmr_kernel.h"

/// Regression for as many inputs as there are lanes. Compiled once a width (treeroll_lanes in
/// CMake).
namespace treeroll {

/// @param inputs   width numbers, within +-kGmmMagnitudeMax
/// @param weights  work space of K x width
/// @param outputs  width x dO, an input a row
using GmrLanes = void (*)(const gmr_kernel::Lines& lines, const double* inputs, double* weights,
                          double* outputs);

void gmr_regress_2(const gmr_kernel::Lines& lines, const double* inputs, double* weights,
                   double* outputs);
void gmr_regress_4(const gmr_kernel::Lines& lines, const double* inputs, double* weights,
                   double* outputs);
void gmr_regress_8(const gmr_kernel::Lines& lines, const double* inputs, double* weights,
                   double* outputs);

}  // namespace treeroll
