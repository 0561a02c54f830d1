#pragma once

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// The double pendulum on a cart in Open Dynamics Engine: a kinematic cart, two links, two hinges,
/// viscous friction as torques, dWorldStep. Of first order in the step. The same bits on one
/// machine (dWorldStep uses no random numbers, dWorldQuickStep would); between machines the last
/// bits may differ. One thread a process: ODE's step shares a global threading implementation.
class OdePlant : public CartPendulumPlant {
 public:
  /// @param step_s  positive; also the output step
  OdePlant(const DoublePendulum& pendulum, double step_s);

  /// Builds its world anew, so that nothing is left of a simulation before.
  Result<CartPendulumState> simulate(const CartPendulumState& start, double duration_s,
                                     const CartAcceleration& input,
                                     const StateVisitor& visit) override;
  std::vector<double> input_times(double duration_s) const override;

 private:
  DoublePendulum pendulum_;
  double step_s_;
};

}  // namespace treeroll::sim
