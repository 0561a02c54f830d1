#include "workers/tasks/riccati.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cstddef>

#include "common/base/check.h"

namespace treeroll {
namespace {

using sim::LinearDynamics;
using sim::StateMatrix;
using sim::StateVector;

StateMatrix symmetric(const StateMatrix& m) { return (m + m.transpose()) / 2; }

/// -dP/dt.
StateMatrix backward_rate(const LinearDynamics& dynamics, const StateMatrix& p,
                          const QuadraticCost& cost) {
  const StateMatrix pa = p * dynamics.by_state;
  const StateVector pb = p * dynamics.by_input;
  return pa + pa.transpose() - pb * pb.transpose() / cost.by_input + cost.by_state;
}

}  // namespace

StateVector regulator_gains(const StateVector& by_input, const StateMatrix& p,
                            const QuadraticCost& cost) {
  return p * by_input / cost.by_input;
}

std::optional<StateMatrix> stationary_riccati(const LinearDynamics& dynamics,
                                              const QuadraticCost& cost) {
  constexpr int kStepsMax = 60;
  constexpr double kSettled = 1e-14;
  const StateMatrix identity = StateMatrix::Identity();
  // The Cayley transform needs a shift that is no eigenvalue of A; one of A's own size serves best.
  const double shift = 1 + dynamics.by_state.norm();
  const StateMatrix a_shifted = dynamics.by_state - shift * identity;
  const Eigen::PartialPivLU<StateMatrix> a_lu(a_shifted);
  const StateMatrix input = dynamics.by_input * dynamics.by_input.transpose() / cost.by_input;
  const StateMatrix a_input = a_lu.solve(input);
  const StateMatrix w = a_shifted.transpose() + cost.by_state * a_input;
  const Eigen::PartialPivLU<StateMatrix> w_lu(w);
  StateMatrix a = identity + 2 * shift * w_lu.solve(identity).transpose();
  StateMatrix g = symmetric(2 * shift * a_input * w_lu.solve(identity));
  StateMatrix h = symmetric(2 * shift * w_lu.solve(cost.by_state * a_lu.solve(identity)));
  for (int step = 0; step < kStepsMax; ++step) {
    const Eigen::PartialPivLU<StateMatrix> lu(identity + g * h);
    const StateMatrix forward = lu.solve(a);
    const StateMatrix gain = symmetric(a.transpose() * h * forward);
    const StateMatrix through = lu.solve(g * a.transpose());
    g = symmetric(g + a * through);
    h += gain;
    a = a * forward;
    if (!h.allFinite() || !g.allFinite()) return std::nullopt;
    if (gain.norm() > kSettled * h.norm()) continue;
    if (regulator_speed(dynamics, regulator_gains(dynamics.by_input, h, cost)).slowest < 0) {
      return h;
    }
    return std::nullopt;
  }
  return std::nullopt;
}

RegulatorSpeed regulator_speed(const LinearDynamics& dynamics, const StateVector& gains) {
  // Zeros in exact arithmetic come out as numbers of this size.
  constexpr double kRounding = 1e-9;
  const StateMatrix closed = dynamics.by_state - dynamics.by_input * gains.transpose();
  const Eigen::EigenSolver<StateMatrix> solver(closed, false);
  CHECK(solver.info() == Eigen::Success, "the eigenvalues of six equations are found");
  RegulatorSpeed speed{.slowest = solver.eigenvalues().real().maxCoeff(),
                       .fastest = solver.eigenvalues().cwiseAbs().maxCoeff()};
  if (speed.slowest > -kRounding * speed.fastest) speed.slowest = std::max(speed.slowest, 0.);
  return speed;
}

std::vector<StateVector> gains_backwards(
    const std::function<LinearDynamics(double time_s)>& dynamics, double duration_s, int num_steps,
    const StateMatrix& end, const QuadraticCost& cost) {
  CHECK(num_steps >= 1 && duration_s > 0, "a motion that takes a step");
  const double h = duration_s / num_steps;
  std::vector<StateVector> gains(static_cast<std::size_t>(num_steps) + 1);
  StateMatrix p = end;
  LinearDynamics here = dynamics(duration_s);
  gains.back() = regulator_gains(here.by_input, p, cost);
  for (int k = num_steps - 1; k >= 0; --k) {
    const LinearDynamics middle = dynamics((k + .5) * h);
    const LinearDynamics start = dynamics(k * h);
    const StateMatrix k1 = backward_rate(here, p, cost);
    const StateMatrix k2 = backward_rate(middle, p + h / 2 * k1, cost);
    const StateMatrix k3 = backward_rate(middle, p + h / 2 * k2, cost);
    const StateMatrix k4 = backward_rate(start, p + h * k3, cost);
    p += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    here = start;
    gains[static_cast<std::size_t>(k)] = regulator_gains(here.by_input, p, cost);
  }
  return gains;
}

}  // namespace treeroll
