#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "learner/fit/fit_tree.h"
#include "learner/fit/sufficient.h"

namespace treeroll {

/// Components that a study may ask for, in a layer.
inline constexpr int kComponentsMax = 64;

/// How long fits of data take, by the number of their components: at most about half a minute of a
/// processor for expectation maximisation, and as long for the refinement.
class FitWork {
 public:
  /// @param data  d x N, inputs over outputs
  FitWork(const Eigen::MatrixXd& data, const FitSettings& fit);

  /// The last of these sizes that may be fitted where each before it is fitted too; the one before
  /// the first where none may.
  int last_of(const SizeRange& sizes) const;
  /// The most components that may be fitted alone; 0 where none may.
  int most_alone() const;

  struct TooMuch {
    std::string key;  ///< of [policy]
    std::string reason;
  };
  /// Why so many may not be fitted alone; empty if they may.
  std::optional<TooMuch> refusal(int components) const;

 private:
  double numbers(int components) const;
  double densities(int components) const;
  double products(int components) const;

  double samples_;
  double inputs_;
  double outputs_;
  double iterations_;
  bool is_refined_;
};

}  // namespace treeroll
