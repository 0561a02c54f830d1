#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "sim/linear_dynamics.h"

/// Linear quadratic regulators of the cart's one input: the u = -K x that makes the integral of
/// x' Q x + R u^2 least, for x' = A x + B u.
namespace treeroll {

struct QuadraticCost {
  sim::StateMatrix by_state;  ///< Q: symmetric, no direction of it negative
  double by_input = 1;        ///< R: positive
};

/// K = B' P / R.
sim::StateVector regulator_gains(const sim::StateVector& by_input, const sim::StateMatrix& p,
                                 const QuadraticCost& cost);

/// The P of A'P + PA - P B B' P / R + Q = 0 whose regulator is stable, by the structure-preserving
/// doubling algorithm of Chu, Fan and Lin (2005): a dozen steps, each twice as far as the one
/// before. Nothing where no P is: an unstable motion that the input does not reach, or one at rest
/// that costs nothing.
std::optional<sim::StateMatrix> stationary_riccati(const sim::LinearDynamics& dynamics,
                                                   const QuadraticCost& cost);

/// Real part of the slowest, and the largest absolute value, of the eigenvalues of A - B K, per
/// second.
struct RegulatorSpeed {
  double slowest = 0;  ///< negative: it is stable
  double fastest = 0;
};
RegulatorSpeed regulator_speed(const sim::LinearDynamics& dynamics, const sim::StateVector& gains);

/// K at the times k duration_s / num_steps, k from 0 to num_steps, of
/// -dP/dt = A'P + PA - P B B' P / R + Q backwards from P(duration_s) = `end`, by the classical
/// Runge-Kutta method. Numbers that are no longer finite are kept: the caller looks.
/// @param dynamics  A and B at a time in [0, duration_s]
std::vector<sim::StateVector> gains_backwards(
    const std::function<sim::LinearDynamics(double time_s)>& dynamics, double duration_s,
    int num_steps, const sim::StateMatrix& end, const QuadraticCost& cost);

}  // namespace treeroll
