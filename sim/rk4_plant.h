#pragma once

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// The equations of motion, integrated by the classical Runge-Kutta method of order 4 with a fixed
/// step. The input is evaluated at each stage, at the stage's time and state. The same bits on
/// every machine.
class Rk4Plant : public CartPendulumPlant {
 public:
  /// @param step_s  positive; also the output step
  Rk4Plant(const DoublePendulum& pendulum, double step_s);

  Result<CartPendulumState> simulate(const CartPendulumState& start, double duration_s,
                                     const CartAcceleration& input,
                                     const StateVisitor& visit) override;
  std::vector<double> input_times(double duration_s) const override;
  std::vector<Result<CartPendulumState>> simulate_open_loop(std::span<const OpenLoop> rollouts,
                                                            double duration_s,
                                                            const OpenLoopVisitor& visit) override;
  bool side_by_side() const override { return true; }

 private:
  DoublePendulum pendulum_;
  double step_s_;
};

}  // namespace treeroll::sim
