#include "sim/cart_pendulum.h"

#include <cmath>

namespace treeroll::sim {

bool is_finite(const CartPendulumState& state) {
  return std::isfinite(state.phi1) && std::isfinite(state.phi2) && std::isfinite(state.y) &&
         std::isfinite(state.phi1_rate) && std::isfinite(state.phi2_rate) &&
         std::isfinite(state.y_rate);
}

std::vector<double> CartPendulumPlant::input_times(double /*duration_s*/) const { return {}; }

std::vector<Result<CartPendulumState>> CartPendulumPlant::simulate_open_loop(
    std::span<const OpenLoop> rollouts, double duration_s, const OpenLoopVisitor& visit) {
  const std::vector<double> times = input_times(duration_s);
  CHECK(!times.empty(), "a plant that tells its input times");
  std::vector<Result<CartPendulumState>> ends;
  ends.reserve(rollouts.size());
  for (std::size_t i = 0; i < rollouts.size(); ++i) {
    const OpenLoop& rollout = rollouts[i];
    CHECK(rollout.accelerations.size() == times.size(), "an input for each of input_times()");
    // Times are asked for in their order, some twice.
    std::size_t at = 0;
    const auto input = [&](double time_s, const CartPendulumState&) {
      while (times[at] < time_s) ++at;
      CHECK(times[at] == time_s, "a plant asks at its input_times()");
      return rollout.accelerations[at];
    };
    ends.push_back(
        simulate(rollout.start, duration_s, input,
                 [&](double time_s, const CartPendulumState& state, double acceleration) {
                   visit(i, time_s, state, acceleration);
                   return true;
                 }));
  }
  return ends;
}

}  // namespace treeroll::sim
