#pragma once

#include <Eigen/Core>

/// Several recordings of one movement are columns one after the other: a new one begins where the
/// time falls.
namespace treeroll {

/// A step of more than so many median ones is a gap: nothing is known of what was there.
inline constexpr int kGapSteps = 5;

/// The median of the steps by which times rise; 0 where none do.
/// @param times  of one recording or several, one after the other
double median_step(const Eigen::Ref<const Eigen::RowVectorXd>& times);

/// How far several recordings are from their mean, as a relative_rms() of the data: no policy that
/// gives one output for each time comes nearer to them all. Each counts between its samples, on
/// straight lines, and by the rate of its samples.
/// @param data  d x N, inputs over outputs; outputs that are missing (NaN) do not count
/// @return      0 of one recording, of rows in no order, and of several inputs: only over a time is
///              it known what recordings have in common
double spread_of_recordings(const Eigen::MatrixXd& data, int input_dim);

}  // namespace treeroll
