#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Prints as CSV what the first perturbed policies of each condition give, those that are drawn
/// before the first update of each repetition, beside the start policy: a row an input for policies
/// of one input, else a row a policy with its theta. Says on standard error how far they go.
/// Nothing is run. Throws StudyError for a study that cannot be run.
void preview_study(const LearnerOptions& options);

}  // namespace treeroll
