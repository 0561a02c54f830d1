#include "learner/explore/systematic_search.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/metric.h"

namespace treeroll::explore {
namespace {

// Measured: notes.md.
constexpr double kGain = .3;
constexpr double kOffset = .15;
constexpr double kShift = .05;
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

std::vector<Eigen::VectorXd> systematic_steps(const PolicyEffect& effect,
                                              const Eigen::MatrixXd& unit, double bold_step,
                                              int num_inputs) {
  if (!does_something(effect)) return {};
  const Eigen::MatrixXd& outputs = effect.outputs;
  const Eigen::Index count = outputs.rows();
  // `unit` is the inverse of J^T J / N, but for directions that hardly move the outputs.
  const double share = std::min(1., bold_step / (kBoldStep * output_size(effect)));
  const auto step_for = [&](const Eigen::MatrixXd& change) -> Eigen::VectorXd {
    return unit * (effect.derivative.transpose() * change.transpose().reshaped()) *
           (share / static_cast<double>(count));
  };
  const Eigen::RowVectorXd rms = outputs.cwiseAbs2().colwise().mean().cwiseSqrt();
  std::vector<Eigen::VectorXd> steps = {step_for(kGain * outputs),
                                        step_for(kOffset * rms.replicate(count, 1))};
  if (num_inputs == 1 && count > 1) {
    const Eigen::MatrixXd delay = kShift * slope(outputs);
    steps.push_back(step_for(delay));
    steps.push_back(step_for(Eigen::VectorXd::LinSpaced(count, 0, 1).asDiagonal() * delay));
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
