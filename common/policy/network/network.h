#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace treeroll {

/// A small network of one hidden layer: output_o = c_o + sum_j a_oj tanh(w_j x + v_j), each input
/// scaled so that its range becomes [-1, 1].
struct Network {
  /// Where an input is expected; past it the network goes on.
  struct Range {
    double low;
    double high;
    bool operator==(const Range&) const = default;
  };

  std::vector<Range> ranges;  ///< dI of them, low < high
  Eigen::MatrixXd outer;      ///< dO x (H + 1): a, then c
  Eigen::MatrixXd inner;      ///< H x (dI + 1): w, then v

  int num_inputs() const { return static_cast<int>(ranges.size()); }
  int num_outputs() const { return static_cast<int>(outer.rows()); }
  int num_hidden() const { return static_cast<int>(inner.rows()); }

  /// All numbers but the ranges: outer row by row, then inner row by row.
  Eigen::VectorXd numbers() const;
  Network with(const Eigen::VectorXd& numbers) const;

  /// Inputs scaled, then what the hidden units make of them, then the outputs.
  /// @param input   num_inputs() finite numbers
  /// @param scaled  num_inputs() numbers
  /// @param hidden  num_hidden() numbers
  /// @param output  num_outputs() numbers
  void act(std::span<const double> input, std::span<double> scaled, std::span<double> hidden,
           std::span<double> output) const;
  /// d output / d numbers, at the input that gave scaled and hidden.
  /// @param into  num_outputs() x numbers
  void derivative(std::span<const double> scaled, std::span<const double> hidden,
                  Eigen::MatrixXd& into) const;
};

}  // namespace treeroll
