#include "learner/report/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace treeroll {

std::optional<double> mean(const std::vector<double>& values) {
  if (values.empty()) return {};
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
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
  double squares = 0;
  for (const double value : values) squares += (value - centre) * (value - centre);
  const double deviation = std::sqrt(squares / (n - 1));
  const boost::math::students_t distribution(n - 1);
  const double half_width = boost::math::quantile(distribution, .975) * deviation / std::sqrt(n);
  return Interval{.low = centre - half_width, .high = centre + half_width};
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
