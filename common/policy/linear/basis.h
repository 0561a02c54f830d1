#pragma once

#include <Eigen/Core>
#include <span>

namespace treeroll {

/// Functions of one input that a policy adds up, each times a coefficient. Immutable.
class Basis {
 public:
  virtual ~Basis() = default;

  virtual int size() const = 0;
  /// The inputs over which they differ: before and after them they stay.
  virtual double low() const = 0;
  virtual double high() const = 0;
  /// How many may differ from 0 at one input.
  virtual int num_at_once() const = 0;
  /// The functions that may differ from 0 at an input; all others are 0 there. Allocates nothing.
  /// @param values  at least num_at_once() numbers
  /// @return        index of the first of them
  virtual int values(double input, std::span<double> values) const = 0;

  /// All functions at several inputs: inputs x size().
  Eigen::MatrixXd matrix(std::span<const double> inputs) const;
};

}  // namespace treeroll
