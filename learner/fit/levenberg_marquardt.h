#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>
#include <utility>

namespace treeroll {

/// J'J (both triangles) and J'r of a sum of squares r'r that is minimised.
struct Normal {
  Eigen::MatrixXd squares;
  Eigen::VectorXd gradient;
};

/// When a least-squares fit is good enough.
struct RegressionSettings {
  /// Of the outputs' rms. To go on to the end makes components that cancel one another: the curve
  /// is met, and a search cannot use them.
  double stop_relative_error = .02;
  int num_steps = 200;
};

/// What the time of a step is proportional to: the sum of squares, and its factor at each of at
/// most 8 tries.
/// @param residuals  whose squares are summed
inline double products_of_step(double numbers, double residuals) {
  return numbers * numbers * (residuals + 8 * numbers / 3);
}

template <typename Point>
struct Minimised {
  Point point;
  double cost;
};

/// One step downhill of Levenberg and Marquardt, (J'J + lam D) s = -J'r, D = diag(J'J) and a
/// millionth of its largest: a direction that moves nothing is damped all the same. Nothing where
/// none is found: a step whose cost is no number is none.
/// @param damping  lam, .3 times as much after a success, 4 times after a failure
template <typename Point, typename Problem>
std::optional<Minimised<Point>> stepped_downhill(const Problem& problem,
                                                 const Minimised<Point>& here, double& damping) {
  constexpr int kTriesMax = 8;
  const Normal normal = problem.normal(here.point);
  const Eigen::VectorXd own = normal.squares.diagonal();
  const double largest = own.maxCoeff();
  if (!(largest > 0)) return std::nullopt;
  for (int tries = 0; tries < kTriesMax; ++tries) {
    Eigen::MatrixXd damped = normal.squares;
    damped.diagonal() += damping * (own.array() + 1e-6 * largest).matrix();
    const Eigen::LLT<Eigen::MatrixXd> factorised(damped);
    if (factorised.info() == Eigen::Success) {
      const Eigen::VectorXd step = -factorised.solve(normal.gradient);
      if (step.allFinite()) {
        Point there = problem.stepped(here.point, step);
        const double cost = problem.cost(there);
        if (cost < here.cost) {
          damping *= .3;
          return Minimised<Point>{std::move(there), cost};
        }
      }
    }
    damping *= 4;
  }
  return std::nullopt;
}

/// The end of that: the relative error that is enough, no step downhill, one that gains less than
/// 1e-7 of the cost, or so many steps.
/// @param problem  has cost(point), mean of squared relative errors; normal(point), of that mean;
///                 and stepped(point, step), a point
template <typename Point, typename Problem>
Minimised<Point> minimised(const Problem& problem, Point start,
                           const RegressionSettings& settings) {
  const double cost = problem.cost(start);
  Minimised<Point> best{std::move(start), cost};
  double damping = 1e-2;
  const double enough = settings.stop_relative_error * settings.stop_relative_error;
  for (int step = 0; step < settings.num_steps && best.cost > enough; ++step) {
    std::optional<Minimised<Point>> better = stepped_downhill(problem, best, damping);
    if (!better) break;
    const double gain = best.cost - better->cost;
    const bool is_little = gain < 1e-7 * best.cost;
    best = *std::move(better);
    if (is_little) break;
  }
  return best;
}

}  // namespace treeroll
