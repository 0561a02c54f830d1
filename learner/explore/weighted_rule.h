#pragma once

#include <functional>
#include <memory>

#include "learner/explore/generation_noise.h"
#include "learner/explore/population_rule.h"

namespace treeroll::explore {

/// What each member of a generation counts: one number for each, sum 1.
using GenerationWeights = std::function<std::vector<double>(std::span<const ToldRollout>)>;

/// A population rule whose mean is that of its weighted generation and whose noise follows it:
/// PI2-BB and the cross-entropy method differ in the weights alone.
std::unique_ptr<UpdateRule> make_weighted_rule(const GenerationSettings& generation,
                                               const GenerationNoise& noise, LayerStart start,
                                               GenerationWeights weights);

}  // namespace treeroll::explore
