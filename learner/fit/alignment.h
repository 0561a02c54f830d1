#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace treeroll {

/// What is done with the times of several demonstrations of one movement before they are set beside
/// each other. People are never equally fast, and a fit over time would take an average of what
/// happened at different moments.
enum class Alignment {
  kNone,
  kDuration,            ///< all begin at one time and last equally long
  kDynamicTimeWarping,  ///< that, and then what looks alike happens at one time
};

/// Their words in a study, in the order of the enumeration.
inline constexpr std::string_view kAlignmentNames[] = {"none", "duration", "dynamic_time_warping"};

/// Pairs of samples that dynamic time warping compares; more are too many.
inline constexpr double kWarpedPairsMax = 1e8;

/// The pairs that aligning these compares: 0 without warping.
double warped_pairs(const std::vector<Eigen::MatrixXd>& demonstrations, Alignment alignment);

/// Puts demonstrations on one time. Outputs stay as they are, and so does the number of samples.
///
/// By duration: times are shifted and stretched to the mean start and the mean duration.
/// By warping: after that, the samples of each demonstration are matched to those of the one whose
/// duration was the median, in order and such that the sum of the squared distances of their
/// outputs is least (Sakoe and Chiba 1978, steps of one sample in either or both). A sample's new
/// time is the mean of the times that it is matched to. Distances are in units of each output's
/// deviation.
///
/// @param demonstrations  each d x N, the time in row 0, not falling and not always the same; the
///                        same d
/// Preconditions: two or more; warped_pairs() at most kWarpedPairsMax.
void align(std::vector<Eigen::MatrixXd>& demonstrations, Alignment alignment);

}  // namespace treeroll
