#include "learner/report/statistics/tests_of_means.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "common/base/check.h"

namespace treeroll::report {
namespace {

using boost::math::students_t;

double squares_about(const std::vector<double>& values, double centre) {
  double sum = 0;
  for (const double value : values) sum += (value - centre) * (value - centre);
  return sum;
}

/// Unbiased. Precondition: two values.
double variance(const std::vector<double>& values) {
  // Equal values have no spread, whatever rounding makes of their mean.
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*low == *high) return 0;
  return squares_about(values, *mean(values)) / static_cast<double>(values.size() - 1);
}

/// P(T > t).
double upper_tail(double t, double degrees) {
  if (std::isinf(t)) return t > 0 ? 0 : 1;
  return boost::math::cdf(boost::math::complement(students_t(degrees), t));
}

TestResult t_test(double difference, double standard_error, double degrees) {
  TestResult result;
  result.difference = difference;
  result.degrees = degrees;
  if (standard_error == 0) {
    result.interval_95 = {.low = difference, .high = difference};
    const double infinity = std::numeric_limits<double>::infinity();
    result.t = difference == 0 ? 0 : std::copysign(infinity, difference);
    result.p = difference == 0 ? .5 : upper_tail(result.t, 1);
    return result;
  }
  const double half = boost::math::quantile(students_t(degrees), .975) * standard_error;
  result.interval_95 = {.low = difference - half, .high = difference + half};
  result.t = difference / standard_error;
  result.p = upper_tail(result.t, degrees);
  return result;
}

/// Ranks 1 .., ties share the mean of theirs.
std::vector<double> midranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&values](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    for (std::size_t i = begin; i < end; ++i) {
      ranks[order[i]] = static_cast<double>(begin + end + 1) / 2;
    }
    begin = end;
  }
  return ranks;
}

}  // namespace

std::optional<TestResult> welch_greater(const std::vector<double>& a,
                                        const std::vector<double>& b) {
  if (a.size() < 2 || b.size() < 2) return {};
  const auto n_a = static_cast<double>(a.size());
  const auto n_b = static_cast<double>(b.size());
  const double of_a = variance(a) / n_a;
  const double of_b = variance(b) / n_b;
  const double sum = of_a + of_b;
  // Welch's and Satterthwaite's degrees of freedom, of shares so that tiny variances do not vanish.
  const double degrees =
      sum > 0 ? 1 / (of_a / sum * (of_a / sum) / (n_a - 1) + of_b / sum * (of_b / sum) / (n_b - 1))
              : n_a + n_b - 2;
  return t_test(*mean(a) - *mean(b), std::sqrt(sum), degrees);
}

std::optional<TestResult> paired_greater(const std::vector<double>& a,
                                         const std::vector<double>& b) {
  CHECK(a.size() == b.size(), "values in pairs must be equally many");
  if (a.size() < 2) return {};
  std::vector<double> differences(a.size());
  std::transform(a.begin(), a.end(), b.begin(), differences.begin(), std::minus<>());
  const auto n = static_cast<double>(a.size());
  return t_test(*mean(differences), std::sqrt(variance(differences) / n), n - 1);
}

std::optional<double> equivalent_p(const std::vector<double>& a, const std::vector<double>& b,
                                   double margin) {
  const auto shifted = [&b](double by) {
    std::vector<double> values = b;
    for (double& value : values) value += by;
    return values;
  };
  const auto above = welch_greater(a, shifted(-margin));  // a > b - margin
  const auto below = welch_greater(shifted(margin), a);   // b + margin > a
  if (!above || !below) return {};
  return std::max(above->p, below->p);
}

std::optional<double> hedges_g(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 2 || b.size() < 2) return {};
  const auto degrees = static_cast<double>(a.size() + b.size() - 2);
  const double pooled = (variance(a) * static_cast<double>(a.size() - 1) +
                         variance(b) * static_cast<double>(b.size() - 1)) /
                        degrees;
  if (pooled == 0) return {};
  const double correction =
      std::exp(std::lgamma(degrees / 2) - std::lgamma((degrees - 1) / 2)) / std::sqrt(degrees / 2);
  return correction * (*mean(a) - *mean(b)) / std::sqrt(pooled);
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&p](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, p[order[i]] * static_cast<double>(p.size() - i));
    adjusted[order[i]] = std::min(largest, 1.0);
  }
  return adjusted;
}

std::vector<std::optional<double>> holm_of_present(const std::vector<std::optional<double>>& p) {
  std::vector<double> tested;
  for (const auto& value : p) {
    if (value) tested.push_back(*value);
  }
  const std::vector<double> adjusted = holm(tested);
  std::vector<std::optional<double>> all;
  std::size_t next = 0;
  for (const auto& value : p) {
    all.push_back(value ? std::optional(adjusted[next++]) : std::nullopt);
  }
  return all;
}

double two_sided(double p) { return std::min(1., 2 * std::min(p, 1 - p)); }

std::optional<Trend> growing(const std::vector<std::vector<double>>& groups) {
  std::vector<double> values;
  std::vector<double> places;
  for (std::size_t group = 0; group < groups.size(); ++group) {
    values.insert(values.end(), groups[group].begin(), groups[group].end());
    places.insert(places.end(), groups[group].size(), static_cast<double>(group));
  }
  if (values.size() < 3 || places.front() == places.back()) return {};
  const std::vector<double> a = midranks(values);
  const std::vector<double> b = midranks(places);
  const double centre = static_cast<double>(values.size() + 1) / 2;
  double product = 0;
  for (std::size_t i = 0; i < a.size(); ++i) product += (a[i] - centre) * (b[i] - centre);
  const double scale = std::sqrt(squares_about(a, centre) * squares_about(b, centre));
  if (scale == 0) return Trend{.correlation = 0, .p = .5};
  const double correlation = std::clamp(product / scale, -1.0, 1.0);
  const auto degrees = static_cast<double>(values.size() - 2);
  const double rest = 1 - correlation * correlation;
  const double t = rest > 0 ? correlation * std::sqrt(degrees / rest)
                            : std::copysign(std::numeric_limits<double>::infinity(), correlation);
  return Trend{.correlation = correlation, .p = upper_tail(t, degrees)};
}

}  // namespace treeroll::report
