#include "learner/explore/scale_trial.h"

#include <algorithm>
#include <cstddef>

#include "common/base/check.h"
#include "learner/explore/perturbation.h"

namespace treeroll::explore {
namespace {

/// Of the best reward of the generation.
constexpr double kEnough = .03;

}  // namespace

ScaleTrial::ScaleTrial(const std::vector<Eigen::MatrixXd>& noises, int population)
    : noises_(noises), population_(population) {
  CHECK(!noises.empty(), "there is something to try");
  for (const Eigen::MatrixXd& noise : noises_) factors_.push_back(noise_factor(noise));
}

/// Draws 1 and 2 are a pair, 3 and 4, and so on; of a second generation, where the first taught
/// nothing, the same places.
std::size_t ScaleTrial::noise_of(int draw) const {
  const int place = draw % population_;
  return place == 0 ? 0 : static_cast<std::size_t>((place - 1) / 2) % noises_.size();
}

Eigen::VectorXd ScaleTrial::next(const Eigen::VectorXd& normal) {
  const Eigen::MatrixXd& factor = factors_[noise_of(num_drawn_++)];
  const Eigen::VectorXd step = factor.triangularView<Eigen::Lower>() * normal;
  return factors_.front().triangularView<Eigen::Lower>().solve(step);
}

const Eigen::MatrixXd& ScaleTrial::best(std::span<const ToldRollout> generation) const {
  double most = 0;
  std::vector<double> by_noise(noises_.size(), 0);
  for (std::size_t i = 0; i < generation.size(); ++i) {
    const RatedRollout& member = generation[i].rated;
    most = std::max(most, member.reward);
    if (member.theta == generation[i].drawn_from->mean) continue;
    double& best = by_noise[noise_of(static_cast<int>(i))];
    best = std::max(best, member.reward);
  }
  std::size_t chosen = 0;
  for (std::size_t k = 1; k < noises_.size(); ++k) {
    const bool is_good = by_noise[k] >= kEnough * most;
    const bool is_chosen_good = by_noise[chosen] >= kEnough * most;
    const bool is_larger = noises_[k].trace() > noises_[chosen].trace();
    const bool is_better = by_noise[k] > by_noise[chosen];
    if (is_good && is_chosen_good ? is_larger : is_good || (!is_chosen_good && is_better)) {
      chosen = k;
    }
  }
  return noises_[chosen];
}

}  // namespace treeroll::explore
