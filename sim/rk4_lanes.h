#pragma once

#include "sim/double_pendulum.h"

/// A step of several plants at once. Compiled once a width (treeroll_lanes in CMake).
namespace treeroll::sim {

/// @param inputs  the cart's accelerations at the step's start, middle and end: 3 x width, row by
/// row
/// @param states  phi1, phi2, y and their rates: 6 x width, row by row; becomes the step's end
using Rk4LaneStep = void (*)(const DoublePendulum& pendulum, double step_s, const double* inputs,
                             double* states);

void rk4_step_2(const DoublePendulum& pendulum, double step_s, const double* inputs,
                double* states);
void rk4_step_4(const DoublePendulum& pendulum, double step_s, const double* inputs,
                double* states);
void rk4_step_8(const DoublePendulum& pendulum, double step_s, const double* inputs,
                double* states);

}  // namespace treeroll::sim
