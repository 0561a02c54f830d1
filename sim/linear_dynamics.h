#pragma once

#include <Eigen/Core>

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// The six numbers of a CartPendulumState in its order: phi1, phi2, y, and their rates.
using StateVector = Eigen::Matrix<double, 6, 1>;
using StateMatrix = Eigen::Matrix<double, 6, 6>;

StateVector to_vector(const CartPendulumState& state);
CartPendulumState to_state(const StateVector& vector);

/// How the time derivative of the state answers to small changes of state and input.
struct LinearDynamics {
  StateMatrix by_state;  ///< A: column j is the answer to number j of the state
  StateVector by_input;  ///< B: the answer to the cart's acceleration
};

/// The exact derivatives of state_derivative() (sim/equations_of_motion.h): (B-7) differentiated by
/// hand. The same bits on every machine.
LinearDynamics linear_dynamics(const DoublePendulum& pendulum, const CartPendulumState& state,
                               double cart_acceleration);

}  // namespace treeroll::sim
