#include "learner/results/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace treeroll {

std::optional<double> mean(const std::vector<double>& values) {
  if (values.empty()) return {};
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<double> deviation(const std::vector<double>& values) {
  if (values.size() < 2) return {};
  const double centre = *mean(values);
  double squares = 0;
  for (const double value : values) squares += (value - centre) * (value - centre);
  return std::sqrt(squares / (static_cast<double>(values.size()) - 1));
}

std::optional<double> median(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

std::optional<Interval> mean_interval_95(const std::vector<double>& values) {
  if (values.size() < 2) return {};
  const double n = static_cast<double>(values.size());
  const double centre = *mean(values);
  const boost::math::students_t distribution(n - 1);
  const double half_width =
      boost::math::quantile(distribution, .975) * *deviation(values) / std::sqrt(n);
  return Interval{.low = centre - half_width, .high = centre + half_width};
}

std::optional<Interval> deviation_interval_95(const std::vector<double>& values) {
  if (values.size() < 2) return {};
  const double degrees = static_cast<double>(values.size()) - 1;
  const boost::math::chi_squared distribution(degrees);
  const double scale = *deviation(values) * std::sqrt(degrees);
  return Interval{.low = scale / std::sqrt(boost::math::quantile(distribution, .975)),
                  .high = scale / std::sqrt(boost::math::quantile(distribution, .025))};
}

std::optional<Interval> median_interval_95(std::vector<double> values) {
  // The k-th smallest value is above the median with P(fewer than k of n below it).
  const std::size_t n = values.size();
  if (n == 0) return {};
  const boost::math::binomial below(static_cast<double>(n), .5);
  std::size_t k = 0;
  while (k < n / 2 && boost::math::cdf(below, static_cast<double>(k)) <= .025) ++k;
  if (k == 0) return {};
  std::sort(values.begin(), values.end());
  return Interval{.low = values[k - 1], .high = values[n - k]};
}

Interval share_interval_95(int successes, int trials) {
  using boost::math::binomial;
  return {.low = binomial::find_lower_bound_on_p(trials, successes, .025),
          .high = binomial::find_upper_bound_on_p(trials, successes, .025)};
}

std::optional<Quartiles> quartiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&values](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return Quartiles{.low = at(.25), .median = at(.5), .high = at(.75)};
}

}  // namespace treeroll
