#pragma once

#include <optional>
#include <vector>

#include "learner/results/statistics.h"

/// Tests of hypotheses about means over repetitions. All are one-sided and small p speaks for the
/// hypothesis named. Where fewer than two values leave the spread unknown there is no result; where
/// there is no spread at all, what is seen is taken for certain: p is 0, 1, or .5 for no
/// difference.
namespace treeroll::report {

struct TestResult {
  double difference = 0;  ///< of the means, a - b
  Interval interval_95;   ///< two-sided, of the difference
  double t = 0;           ///< infinite without spread
  double degrees = 0;     ///< of freedom
  double p = 0;
};

/// Two samples, the hypothesis: mean of a > mean of b. Welch's t-test: variances may differ. The
/// thesis uses a two-sample t-test in figures 4-6 and 4-14.
std::optional<TestResult> welch_greater(const std::vector<double>& a, const std::vector<double>& b);

/// The same for values in pairs, a[i] with b[i]: repetitions of two conditions that share their
/// random numbers. Precondition: equally many.
std::optional<TestResult> paired_greater(const std::vector<double>& a,
                                         const std::vector<double>& b);

/// The hypothesis: |mean of a - mean of b| < margin. Two one-sided Welch tests (TOST): the larger
/// p.
std::optional<double> equivalent_p(const std::vector<double>& a, const std::vector<double>& b,
                                   double margin);

/// Hedges' g: difference of the means in units of the pooled standard deviation, with the exact
/// correction for small samples. Nothing for fewer than two values or without spread.
std::optional<double> hedges_g(const std::vector<double>& a, const std::vector<double>& b);

/// Adjusted p-values by Holm's step-down: below .05 means significant with a chance of at most 5 %
/// that any true null hypothesis of the family is rejected. In the order given.
std::vector<double> holm(const std::vector<double>& p);
/// The same over those that are there; nothing for the others.
std::vector<std::optional<double>> holm_of_present(const std::vector<std::optional<double>>& p);

/// The p of a one-sided test as that of the two-sided one, whichever side is ahead: for whoever had
/// no side in mind before.
double two_sided(double p);

/// The hypothesis: values grow with the place of their group. Spearman's rank correlation of value
/// and group with midranks for ties, p by Student's t. Nothing for fewer than three values in all
/// or without two groups; equal values give p .5.
struct Trend {
  double correlation = 0;
  double p = 0;
};
std::optional<Trend> growing(const std::vector<std::vector<double>>& groups);

}  // namespace treeroll::report
