#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "learner/report/document.h"
#include "learner/report/policy_terms.h"
#include "learner/results/study_results.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll::report {

/// The pictures of a study, and in sentences what is to be known of them.
struct StudyPictures {
  std::vector<Picture> pictures;
  std::vector<std::string> remarks;  ///< what was left out and why; neither dates nor paths
  std::vector<PolicyTerms> terms;    ///< of the roll-outs in them
};

/// Draws a study's pictures into OUTPUT/figures/STUDY. Goals, trajectories and motion are recorded
/// by a worker executable. What cannot be had (a demonstration that was moved away, an executable
/// that is not there) leaves its pictures out: that is a remark, and its cause goes to standard
/// error.
/// @param noise_rollouts_max  bounds the work of the noise's growth, see noise_levels()
/// Throws std::runtime_error if gnuplot or the disk fails.
StudyPictures draw_study(const StudyResults& results, const std::filesystem::path& output,
                         const WorkerProgram& worker_program, std::int64_t noise_rollouts_max);

}  // namespace treeroll::report
