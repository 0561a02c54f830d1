#include "learner/explore/systematic_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/metric.h"

namespace treeroll::explore {
namespace {

// Measured: notes.md.
constexpr double kGain = .3;
constexpr double kOffset = .15;
constexpr double kShift = .05;
/// Of the gain's change: a change of less is none.
constexpr double kSame = .01;
constexpr int kGenerations = 4;
constexpr double kShrink = .7;

/// d output / d input, N x dO, per range of the input: the inputs are evenly spaced.
Eigen::MatrixXd slope(const Eigen::MatrixXd& outputs) {
  const Eigen::Index last = outputs.rows() - 1;
  Eigen::MatrixXd slope(outputs.rows(), outputs.cols());
  for (Eigen::Index i = 0; i <= last; ++i) {
    const Eigen::Index before = std::max<Eigen::Index>(i - 1, 0);
    const Eigen::Index after = std::min(i + 1, last);
    slope.row(i) = (outputs.row(after) - outputs.row(before)) * static_cast<double>(last) /
                   static_cast<double>(after - before);
  }
  return slope;
}

}  // namespace

std::vector<Eigen::VectorXd> systematic_steps(const PolicyEffect& effect, double boldness,
                                              int num_inputs) {
  const Eigen::MatrixXd& outputs = effect.outputs;
  const Eigen::Index count = outputs.rows();
  const Eigen::RowVectorXd rms = outputs.cwiseAbs2().colwise().mean().cwiseSqrt();
  std::vector<Eigen::MatrixXd> changes = {kGain * outputs, kOffset * rms.replicate(count, 1)};
  if (num_inputs == 1 && count > 1) {
    const Eigen::MatrixXd delay = kShift * slope(outputs);
    changes.push_back(delay);
    changes.push_back(Eigen::VectorXd::LinSpaced(count, 0, 1).asDiagonal() * delay);
  }
  // The inverse of J^T J / N, but for directions that hardly move the outputs.
  const Eigen::MatrixXd unit = step_covariance(effect, Metric::kFull, output_size(effect));
  std::vector<Eigen::VectorXd> steps;
  Eigen::MatrixXd taken(outputs.size(), 0);  // orthonormal
  for (const Eigen::MatrixXd& change : changes) {
    const Eigen::VectorXd curve = change.transpose().reshaped();
    const Eigen::VectorXd rest = curve - taken * (taken.transpose() * curve);
    if (rest.norm() <= kSame * kGain * outputs.norm()) continue;
    taken.conservativeResize(Eigen::NoChange, taken.cols() + 1);
    taken.rightCols(1) = rest.normalized();
    steps.push_back(boldness / static_cast<double>(count) *
                    (unit * (effect.derivative.transpose() * curve)));
  }
  return steps;
}

SystematicSearch::SystematicSearch(RatedRollout start, const std::vector<Eigen::VectorXd>& steps)
    : best_(std::move(start)) {
  CHECK(!steps.empty(), "there is a step to try");
  for (const Eigen::VectorXd& step : steps) {
    steps_.push_back(step);
    steps_.push_back(-step);
  }
}

Eigen::VectorXd SystematicSearch::next() { return best_.theta + steps_.at(num_drawn_++); }

void SystematicSearch::learn(std::span<const RatedRollout> generation) {
  for (const RatedRollout& member : generation) {
    if (ranks_before(member, best_)) best_ = member;
  }
  for (Eigen::VectorXd& step : steps_) step *= kShrink;
  num_drawn_ = 0;
  ++num_generations_;
}

bool SystematicSearch::is_over() const { return num_generations_ == kGenerations; }

}  // namespace treeroll::explore
