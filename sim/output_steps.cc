#include "sim/output_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

namespace treeroll::sim {
namespace {

/// A duration that is a multiple of the step but for rounding does not get a sliver of a step.
std::int64_t num_steps(double duration_s, double step_s) {
  constexpr double kRounding = 1e-9;
  return static_cast<std::int64_t>(std::ceil(duration_s / step_s - kRounding));
}

}  // namespace

OutputSteps::OutputSteps(double duration_s, double step_s)
    : duration_s_(duration_s), step_s_(step_s), size_(num_steps(duration_s, step_s)) {
  CHECK(std::isfinite(duration_s) && duration_s >= 0, "the duration is finite and not negative");
  CHECK(std::isfinite(step_s) && step_s > 0, "the step is finite and positive");
}

std::vector<double> OutputSteps::starts_and_middles_s() const {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(2 * size_ + 1));
  for (std::int64_t k = 0; k < size_; ++k) {
    times.push_back(time_s(k));
    times.push_back(time_s(k) + length_s(k) / 2);
  }
  times.push_back(duration_s_);
  return times;
}

Error not_finite(std::string_view what, double time_s) {
  return Error{fmt::format("the {} is not finite at {:.6g} s", what, time_s)};
}

Error not_finite(const CartPendulumState& state, double time_s) {
  const std::pair<const char*, double> numbers[] = {
      {"angle of link 1", state.phi1},     {"angle of link 2", state.phi2},
      {"cart's position", state.y},        {"rate of link 1", state.phi1_rate},
      {"rate of link 2", state.phi2_rate}, {"cart's velocity", state.y_rate}};
  const auto* const first = std::ranges::find_if(
      numbers, [](const auto& number) { return !std::isfinite(number.second); });
  CHECK(first != std::end(numbers), "all numbers of the state are finite");
  return not_finite(first->first, time_s);
}

Result<CartPendulumState> run_output_steps(const CartPendulumState& start, double duration_s,
                                           double step_s, const CartAcceleration& input,
                                           const StateVisitor& visit, const StateStep& advance) {
  const OutputSteps steps(duration_s, step_s);
  CartPendulumState state = start;
  for (std::int64_t k = 0;; ++k) {
    const double time_s = steps.time_s(k);
    if (!is_finite(state)) return not_finite(state, time_s);
    const double cart_acceleration = input(time_s, state);
    if (!std::isfinite(cart_acceleration)) return not_finite("cart's acceleration", time_s);
    if (!visit(time_s, state, cart_acceleration) || k == steps.size()) return state;
    Result<CartPendulumState> next = advance(time_s, steps.length_s(k), state, cart_acceleration);
    if (!next) return next.error();
    state = *next;
  }
}

}  // namespace treeroll::sim
