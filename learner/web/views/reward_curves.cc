#include "learner/web/views/reward_curves.h"

#include <algorithm>
#include <cmath>

namespace treeroll::web {

double quantile(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

RewardCurves::RewardCurves(int num_runs, int num_rollouts, int points_max)
    : num_runs_(num_runs), width_((num_rollouts + points_max - 1) / points_max) {
  const auto num_points = static_cast<std::size_t>((num_rollouts + width_ - 1) / width_);
  cells_.resize(num_points * static_cast<std::size_t>(num_runs));
  changed_.resize(num_points, true);
  points_.resize(num_points);
}

void RewardCurves::add(int repetition, int rollout, double reward, double best) {
  const auto place = static_cast<std::size_t>(rollout / width_);
  Cell& cell =
      cells_[place * static_cast<std::size_t>(num_runs_) + static_cast<std::size_t>(repetition)];
  cell.sum += reward;
  ++cell.count;
  cell.best = std::max(cell.best, best);
  changed_[place] = true;
}

RewardCurves::Point RewardCurves::point_of(std::size_t place) const {
  Point point;
  point.rollout = static_cast<double>(place) * width_ + (width_ + 1) / 2.;
  std::vector<double> means;
  double best = 0;
  const auto begin = cells_.begin() + static_cast<std::ptrdiff_t>(place) * num_runs_;
  for (auto cell = begin; cell != begin + num_runs_; ++cell) {
    if (cell->count == 0) continue;
    means.push_back(cell->sum / cell->count);
    best += cell->best;
  }
  point.num_runs = static_cast<int>(means.size());
  if (means.empty()) return point;
  for (const double mean : means) point.mean += mean / point.num_runs;
  point.best = best / point.num_runs;
  point.lower_quartile = quantile(means, .25);
  point.median = quantile(means, .5);
  point.upper_quartile = quantile(means, .75);
  return point;
}

const std::vector<RewardCurves::Point>& RewardCurves::points() {
  for (std::size_t place = 0; place < points_.size(); ++place) {
    if (!changed_[place]) continue;
    points_[place] = point_of(place);
    changed_[place] = false;
  }
  return points_;
}

}  // namespace treeroll::web
