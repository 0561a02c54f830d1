#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/mixture/gmm.h"

/// A sample may lack outputs: a sensor was out for a while. Such a number is NaN in data d x N;
/// inputs are always there. A joint density knows what to do with it (Ghahramani and Jordan 1994):
/// a sample counts by the density of what it has, and what it lacks is expected from that, with the
/// variance that is left.
namespace treeroll {

/// Whether nothing is missing.
bool is_complete(const Eigen::MatrixXd& data);

/// The rows that a sample has, ascending.
std::vector<Eigen::Index> rows_of(const Eigen::VectorXd& sample);

/// The Gaussian of some of its variables.
Component marginal(const Component& component, const std::vector<Eigen::Index>& rows);

/// Of each row, over the numbers that are there; 0 exactly where all are the same.
Eigen::VectorXd variances(const Eigen::MatrixXd& data);

struct Completed {
  /// With each number that is missing replaced by what the Gaussian expects given what the sample
  /// has.
  Eigen::MatrixXd data;
  /// The weighted mean over the samples of the covariance that is left: d x d.
  Eigen::MatrixXd left;
};
/// @param weight  N x 1, not all 0
Completed completed(const Component& component, const Eigen::MatrixXd& data,
                    const Eigen::VectorXd& weight);

}  // namespace treeroll
