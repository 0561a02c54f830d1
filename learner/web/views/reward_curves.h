#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace treeroll::web {

/// Rewards of a condition's runs over roll-outs, for a picture: neighbouring roll-outs share a
/// point, so that it stays small whatever a study's size. Fed with each applied result, once.
class RewardCurves {
 public:
  /// @param points_max  at least 1
  RewardCurves(int num_runs, int num_rollouts, int points_max);

  /// @param best  the highest reward of its run, this roll-out included
  void add(int repetition, int rollout, double reward, double best);

  /// What the runs have come to at a point, each by the mean over its roll-outs there.
  struct Point {
    double rollout = 0;  ///< in the middle, counted from 1
    int num_runs = 0;    ///< that have come so far; 0: nothing below is known
    double mean = 0;
    double lower_quartile = 0;
    double median = 0;
    double upper_quartile = 0;
    double best = 0;  ///< mean over the runs of the highest reward up to here
  };
  /// Those that have changed are computed anew.
  const std::vector<Point>& points();

  int rollouts_per_point() const { return width_; }

 private:
  struct Cell {
    double sum = 0;
    std::uint32_t count = 0;
    double best = 0;
  };
  Point point_of(std::size_t place) const;

  int num_runs_;
  int width_;
  std::vector<Cell> cells_;  ///< by point, then run
  std::vector<Point> points_;
  std::vector<bool> changed_;  ///< by point
};

/// Linear interpolation between order statistics (R's type 7). Sorts. Precondition: values.
double quantile(std::vector<double>& values, double share);

}  // namespace treeroll::web
