#pragma once

#include <optional>
#include <string>
#include <vector>

#include "learner/report/statistics/sample.h"
#include "learner/report/statistics/tests_of_means.h"

namespace treeroll::report {

/// Whether condition a is better than condition b, at the end and at every roll-out.
struct Comparison {
  std::string a;
  std::string b;
  int num_a = 0;  ///< repetitions that have a reward at the end
  int num_b = 0;
  std::optional<double> mean_a;  ///< near the last roll-out
  std::optional<double> mean_b;
  std::optional<TestResult> end;     ///< a > b near the last roll-out
  std::optional<TestResult> paired;  ///< the same by repetition, where random numbers are shared
  std::optional<double> g;           ///< Hedges'
  using ByRollout = std::vector<std::optional<double>>;
  ByRollout p;       ///< a > b at each roll-out; nothing where fewer than two runs got there
  ByRollout p_holm;  ///< over the roll-outs
};

/// @param share_draws  repetitions of both share their random numbers
Comparison compare(const std::string& label_a, const std::vector<MeasuredRun>& a,
                   const std::string& label_b, const std::vector<MeasuredRun>& b, bool share_draws);

/// Holm's adjusted p of each comparison at the end, over those that have one.
std::vector<std::optional<double>> adjusted_p(const std::vector<Comparison>& comparisons);

/// Every roll-out of several comparisons as one family: two-sided p-values by Holm's step-down over
/// all of them. Below .05 wherever something is there but for a chance of 5 % that any of all these
/// is false, however the tests depend on each other.
/// @return  by comparison and roll-out
std::vector<Comparison::ByRollout> family_wise(const std::vector<Comparison>& comparisons);

}  // namespace treeroll::report
