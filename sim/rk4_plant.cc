#include "sim/rk4_plant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/numbers/processor.h"
#include "sim/output_steps.h"
#include "sim/rk4_kernel.h"
#include "sim/rk4_lanes.h"

namespace treeroll::sim {
namespace {

constexpr std::size_t kWidthMax = 8;

kernel::State<double> to_kernel(const CartPendulumState& s) {
  return {s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate};
}

CartPendulumState from_kernel(const kernel::State<double>& s) {
  return {s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate};
}

void rk4_step_1(const DoublePendulum& pendulum, double step_s, const double* inputs,
                double* states) {
  constexpr std::array<int, 4> kRows = {0, 1, 1, 2};
  const kernel::State<double> end = kernel::rk4_step<double>(
      pendulum, step_s, {states[0], states[1], states[2], states[3], states[4], states[5]},
      [&](std::size_t stage, const kernel::State<double>&) { return inputs[kRows[stage]]; });
  states[0] = end.phi1, states[1] = end.phi2, states[2] = end.y;
  states[3] = end.phi1_rate, states[4] = end.phi2_rate, states[5] = end.y_rate;
}

struct Lanes {
  std::size_t width;
  Rk4LaneStep step;
};

/// The narrowest that holds so many roll-outs, or the widest there is.
Lanes lanes_for(std::size_t num_rollouts) {
  constexpr std::array<Lanes, 4> kAll = {
      {{1, &rk4_step_1}, {2, &rk4_step_2}, {4, &rk4_step_4}, {kWidthMax, &rk4_step_8}}};
  Lanes chosen = kAll[0];
  for (const Lanes& lanes : kAll) {
    if (lanes.width > static_cast<std::size_t>(widest_lanes())) break;
    chosen = lanes;
    if (chosen.width >= num_rollouts) break;
  }
  return chosen;
}

/// Roll-outs side by side; those that are fewer than the lanes leave lanes at rest.
class LaneStates {
 public:
  LaneStates(std::span<const OpenLoop> rollouts, std::size_t width)
      : rollouts_(rollouts), width_(width) {
    for (std::size_t lane = 0; lane < rollouts.size(); ++lane) set(lane, rollouts[lane].start);
  }

  CartPendulumState state(std::size_t lane) const {
    const double* s = states_.data() + lane;
    return {s[0], s[width_], s[2 * width_], s[3 * width_], s[4 * width_], s[5 * width_]};
  }
  void set(std::size_t lane, const CartPendulumState& x) {
    double* s = states_.data() + lane;
    for (const double number : {x.phi1, x.phi2, x.y, x.phi1_rate, x.phi2_rate, x.y_rate}) {
      *s = number;
      s += width_;
    }
  }
  /// Step k: from input 2 k, over 2 k + 1 in its middle, to 2 k + 2.
  void advance(Rk4LaneStep step, const DoublePendulum& pendulum, double step_s, std::size_t k) {
    for (std::size_t lane = 0; lane < rollouts_.size(); ++lane) {
      for (std::size_t row = 0; row < 3; ++row) {
        inputs_[row * width_ + lane] = rollouts_[lane].accelerations[2 * k + row];
      }
    }
    step(pendulum, step_s, inputs_.data(), states_.data());
  }

 private:
  std::span<const OpenLoop> rollouts_;
  std::size_t width_;
  std::array<double, 6 * kWidthMax> states_{};
  std::array<double, 3 * kWidthMax> inputs_{};
};

}  // namespace

Rk4Plant::Rk4Plant(const DoublePendulum& pendulum, double step_s)
    : pendulum_(pendulum), step_s_(step_s) {}

Result<CartPendulumState> Rk4Plant::simulate(const CartPendulumState& start, double duration_s,
                                             const CartAcceleration& input,
                                             const StateVisitor& visit) {
  const auto advance = [&](double t, double h, const CartPendulumState& x,
                           double cart_acceleration) -> Result<CartPendulumState> {
    const std::array<double, 4> times = {t, t + h / 2, t + h / 2, t + h};
    return from_kernel(kernel::rk4_step<double>(
        pendulum_, h, to_kernel(x), [&](std::size_t stage, const kernel::State<double>& at) {
          return stage == 0 ? cart_acceleration : input(times[stage], from_kernel(at));
        }));
  };
  return run_output_steps(start, duration_s, step_s_, input, visit, advance);
}

std::vector<double> Rk4Plant::input_times(double duration_s) const {
  return OutputSteps(duration_s, step_s_).starts_and_middles_s();
}

std::vector<Result<CartPendulumState>> Rk4Plant::simulate_open_loop(
    std::span<const OpenLoop> rollouts, double duration_s, const OpenLoopVisitor& visit) {
  const OutputSteps steps(duration_s, step_s_);
  const auto num_inputs = static_cast<std::size_t>(2 * steps.size() + 1);
  for (const OpenLoop& rollout : rollouts) {
    CHECK(rollout.accelerations.size() == num_inputs, "an input for each of input_times()");
  }
  std::vector<Result<CartPendulumState>> ends;
  ends.reserve(rollouts.size());
  while (ends.size() < rollouts.size()) {
    const std::size_t first = ends.size();
    const Lanes lanes = lanes_for(rollouts.size() - first);
    const auto group = rollouts.subspan(first, std::min(lanes.width, rollouts.size() - first));
    LaneStates states(group, lanes.width);
    std::array<std::optional<Error>, kWidthMax> errors;
    for (std::int64_t k = 0; k <= steps.size(); ++k) {
      const double time_s = steps.time_s(k);
      for (std::size_t lane = 0; lane < group.size(); ++lane) {
        if (errors[lane]) continue;
        const CartPendulumState state = states.state(lane);
        const double input = group[lane].accelerations[static_cast<std::size_t>(2 * k)];
        if (!is_finite(state)) {
          errors[lane] = not_finite(state, time_s);
        } else if (!std::isfinite(input)) {
          errors[lane] = not_finite("cart's acceleration", time_s);
        } else {
          visit(first + lane, time_s, state, input);
        }
      }
      if (k < steps.size()) {
        states.advance(lanes.step, pendulum_, steps.length_s(k), static_cast<std::size_t>(k));
      }
    }
    for (std::size_t lane = 0; lane < group.size(); ++lane) {
      if (errors[lane]) {
        ends.emplace_back(*errors[lane]);
      } else {
        ends.emplace_back(states.state(lane));
      }
    }
  }
  return ends;
}

}  // namespace treeroll::sim
