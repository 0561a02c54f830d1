#include "learner/explore/weighted_update.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll::explore {

std::vector<double> pi2_weights(std::span<const ToldRollout> generation, double eliteness) {
  CHECK(!generation.empty(), "an update needs a roll-out");
  double least = generation[0].rated.reward;
  double most = least;
  for (const ToldRollout& member : generation) {
    least = std::min(least, member.rated.reward);
    most = std::max(most, member.rated.reward);
  }
  std::vector<double> weights;
  weights.reserve(generation.size());
  double sum = 0;
  for (const ToldRollout& member : generation) {
    const double below = most > least ? (member.rated.reward - most) / (most - least) : 0;
    weights.push_back(elementary::exp(eliteness * below));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

std::vector<double> cem_weights(std::span<const ToldRollout> generation, int num_elites) {
  CHECK(num_elites >= 1 && static_cast<std::size_t>(num_elites) <= generation.size(),
        "elites are members of the generation");
  std::vector<std::size_t> order(generation.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return ranks_before(generation[a].rated, generation[b].rated);
  });
  std::vector<double> weights(generation.size(), 0.);
  for (int i = 0; i < num_elites; ++i) {
    weights[order[static_cast<std::size_t>(i)]] = 1. / num_elites;
  }
  return weights;
}

SearchDistribution weighted_update(std::span<const ToldRollout> generation,
                                   std::span<const double> weights,
                                   const SearchDistribution& before, const NoiseUpdate& noise) {
  CHECK(generation.size() == weights.size(), "a weight for each member");
  SearchDistribution updated;
  updated.mean = Eigen::VectorXd::Zero(before.mean.size());
  updated.noise = (1 - noise.learning_rate) * noise.decay * before.noise;
  updated.noise.diagonal() += noise.learning_rate * noise.minimum_noise;
  for (std::size_t i = 0; i < generation.size(); ++i) {
    if (weights[i] == 0) continue;
    const Eigen::VectorXd& theta = generation[i].rated.theta;
    const Eigen::VectorXd perturbation = theta - generation[i].drawn_from->mean;
    updated.mean += weights[i] * theta;
    updated.noise.selfadjointView<Eigen::Lower>().rankUpdate(
        perturbation, noise.learning_rate * noise.decay * weights[i]);
  }
  updated.noise.triangularView<Eigen::StrictlyUpper>() = updated.noise.transpose();
  return updated;
}

}  // namespace treeroll::explore
