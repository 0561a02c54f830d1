#pragma once

#include <cstdint>

#include "learner/core/study.h"
#include "learner/report/figures/study_plots.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// The exploration noise after each applied roll-out of a study, recomputed: a run is a function of
/// its study and its results, so every roll-out is drawn and learnt from again.
/// @param rollouts_max  bounds the work: of each condition the first so many repetitions, equally
///                      many of all; none at all if that is not one
/// Throws std::runtime_error where the results do not follow from the study, or where they were
/// applied as they arrived or the study was learnt for a time, and the journal cannot be read.
NoiseLevels noise_levels(const Study& study, const StudyResults& results,
                         std::int64_t rollouts_max);

}  // namespace treeroll::report
