#include "learner/explore/weighted_rule.h"

#include <utility>

namespace treeroll::explore {
namespace {

class WeightedRule final : public PopulationRule {
 public:
  WeightedRule(const GenerationSettings& generation, const GenerationNoise& noise, LayerStart start,
               GenerationWeights weights)
      : PopulationRule(generation, std::move(start.distribution)),
        noise_(noise),
        noise_variance_(std::move(start.noise_variance)),
        weights_(std::move(weights)) {}

 private:
  SearchDistribution updated(std::span<const ToldRollout> generation,
                             const SearchDistribution& before, int num_results_of_run) override {
    return weighted_update(generation, weights_(generation), before,
                           noise_update(noise_, num_results_of_run, noise_variance_));
  }

  GenerationNoise noise_;
  Eigen::VectorXd noise_variance_;  // n x 1
  GenerationWeights weights_;
};

}  // namespace

std::unique_ptr<UpdateRule> make_weighted_rule(const GenerationSettings& generation,
                                               const GenerationNoise& noise, LayerStart start,
                                               GenerationWeights weights) {
  return std::make_unique<WeightedRule>(generation, noise, std::move(start), std::move(weights));
}

}  // namespace treeroll::explore
