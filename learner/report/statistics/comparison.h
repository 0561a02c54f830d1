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
  std::vector<double> p;             ///< a > b at each roll-out; 1 where too few runs got there
  std::vector<double> p_holm;        ///< over the roll-outs
};

/// @param share_draws  repetitions of both share their random numbers
Comparison compare(const std::string& label_a, const std::vector<const RunRecord*>& a,
                   const std::string& label_b, const std::vector<const RunRecord*>& b,
                   bool share_draws);

}  // namespace treeroll::report
