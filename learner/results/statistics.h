#pragma once

#include <optional>
#include <vector>

namespace treeroll {

struct Interval {
  double low = 0;
  double high = 0;
  bool operator==(const Interval&) const = default;
};

/// Where the mean of the population lies with 95 % confidence, by Student's t: values independent
/// and about normal. Nothing for fewer than two values, which say nothing about their spread.
std::optional<Interval> mean_interval_95(const std::vector<double>& values);

/// A share of successes in trials: exact binomial limits (Clopper and Pearson), 95 %.
/// Precondition: 0 <= successes <= trials, trials > 0.
Interval share_interval_95(int successes, int trials);

/// Where the standard deviation of the population lies with 95 % confidence, by chi-square: values
/// independent and about normal. Nothing for fewer than two values.
std::optional<Interval> deviation_interval_95(const std::vector<double>& values);

/// Where the median of the population lies with at least 95 % confidence, 2.5 % on either side:
/// two of the ordered values, whatever the distribution. Nothing for fewer than six values, of
/// which no two suffice.
std::optional<Interval> median_interval_95(std::vector<double> values);

/// Nothing for no value.
std::optional<double> mean(const std::vector<double>& values);
/// Standard deviation of the population, unbiased in its square. Nothing for fewer than two values.
std::optional<double> deviation(const std::vector<double>& values);
/// The middle one, or the mean of the two in the middle. Nothing for no value.
std::optional<double> median(std::vector<double> values);

struct Quartiles {
  double low = 0;
  double median = 0;
  double high = 0;
  bool operator==(const Quartiles&) const = default;
};
/// By linear interpolation between the ordered values (R's type 7). Nothing for no value.
std::optional<Quartiles> quartiles(std::vector<double> values);

}  // namespace treeroll
