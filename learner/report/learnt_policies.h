#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/report/figures/layer_plot.h"
#include "learner/report/figures/learnt_policy.h"
#include "learner/report/policy_terms.h"
#include "learner/results/study_results.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll::report {

/// What the conditions of a study began with and their best policies, that of all repetitions and
/// that of each. Throws std::runtime_error for a policy file that cannot be read.
std::vector<LearntPolicy> learnt_policies(const LoadedStudy& loaded, const StudyResults& results);

/// Has a worker executable make the roll-outs of these policies, with seed 0. None of a task that
/// says repeatable = false.
/// @return  in sentences what could not be made, or what is to be known of it; the cause of a
///          failure goes to standard error
std::vector<std::string> make_rollouts(const LoadedStudy& loaded,
                                       const WorkerProgram& worker_program,
                                       std::vector<LearntPolicy>& policies);

/// Of the roll-outs that were made, those of a task that says what its rewards are made of.
std::vector<PolicyTerms> terms_of(const std::vector<LearntPolicy>& policies);

/// The start policies, each once, with the conditions that share it. Their variables have the
/// names of names_of().
std::vector<StartModel> start_models(const LoadedStudy& loaded,
                                     const std::vector<LearntPolicy>& policies);

}  // namespace treeroll::report
