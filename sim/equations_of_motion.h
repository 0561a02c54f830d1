#pragma once

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// Equations of motion of the double pendulum on a cart, thesis (B-7), for a given acceleration of
/// the cart. The print lacks a2 m2 g sin(phi2) in the second row and has friction (B-4) without the
/// coupling between the joints; both are as they must be here (energy is conserved without
/// friction). Uses the portable elementary functions: the same bits on every machine.
/// @param cart_acceleration  m/s^2
/// @return the time derivative of each element of the state, in the element's place: rates in
///         phi1, phi2, y and accelerations in phi1_rate, phi2_rate, y_rate
CartPendulumState state_derivative(const DoublePendulum& pendulum, const CartPendulumState& state,
                                   double cart_acceleration);

/// Energy of the links as seen from the cart (the kinetic energy of the cart's own motion is not in
/// it), in J; potential energy 0 at the height of the cart. Without friction and acceleration of
/// the cart it is constant.
double pendulum_energy(const DoublePendulum& pendulum, const CartPendulumState& state);

}  // namespace treeroll::sim
