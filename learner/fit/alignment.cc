#include "learner/fit/alignment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include "common/base/check.h"
#include "learner/fit/missing_outputs.h"

namespace treeroll {
namespace {

using Demonstrations = std::vector<Eigen::MatrixXd>;

double start_of(const Eigen::MatrixXd& one) { return one(0, 0); }
double duration_of(const Eigen::MatrixXd& one) { return one(0, one.cols() - 1) - one(0, 0); }

/// The place of the median duration; of the lower one of two.
std::size_t median_duration(const Demonstrations& all) {
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return duration_of(all[a]) < duration_of(all[b]);
  });
  return order[(order.size() - 1) / 2];
}

void scale_to_mean_duration(Demonstrations& all) {
  double start = 0, duration = 0;
  for (const Eigen::MatrixXd& one : all) {
    start += start_of(one) / static_cast<double>(all.size());
    duration += duration_of(one) / static_cast<double>(all.size());
  }
  for (Eigen::MatrixXd& one : all) {
    const double own_start = start_of(one), own_duration = duration_of(one);
    for (Eigen::Index n = 0; n < one.cols(); ++n) {
      one(0, n) = start + (one(0, n) - own_start) / own_duration * duration;
    }
  }
}

/// 1 / variance of each output over all demonstrations; 0 of one that does not vary.
Eigen::VectorXd output_weights(const Demonstrations& all) {
  Eigen::Index num_samples = 0;
  for (const Eigen::MatrixXd& one : all) num_samples += one.cols();
  Eigen::MatrixXd together(all.front().rows() - 1, num_samples);
  Eigen::Index next = 0;
  for (const Eigen::MatrixXd& one : all) {
    together.middleCols(next, one.cols()) = one.bottomRows(one.rows() - 1);
    next += one.cols();
  }
  const Eigen::VectorXd variance = variances(together);
  return (variance.array() > 0).select(variance.cwiseInverse(), 0);
}

/// Outputs that samples lack, on straight lines between those that its neighbours have: only to be
/// compared. Sensors that are read in turn would else have no output in common, and such a pair,
/// which costs nothing, would draw every way along. An output that a recording never has is left.
Eigen::MatrixXd interpolated(Eigen::MatrixXd one) {
  for (Eigen::Index row = 1; row < one.rows(); ++row) {
    Eigen::Index last = -1;
    for (Eigen::Index n = 0; n < one.cols(); ++n) {
      if (std::isnan(one(row, n))) continue;
      for (Eigen::Index i = last + 1; i < n; ++i) {
        const double length = last < 0 ? 0 : one(0, n) - one(0, last);
        const double share = length > 0 ? (one(0, i) - one(0, last)) / length : 1;
        one(row, i) = last < 0 ? one(row, n) : (1 - share) * one(row, last) + share * one(row, n);
      }
      last = n;
    }
    for (Eigen::Index i = last + 1; last >= 0 && i < one.cols(); ++i) one(row, i) = one(row, last);
  }
  return one;
}

/// Where the best way to a pair of samples comes from.
enum class Step : std::uint8_t { kBoth, kOwn, kReference };

/// The times that the samples of `one` get on the reference's clock; both are interpolated().
Eigen::RowVectorXd warped_times(const Eigen::MatrixXd& one, const Eigen::MatrixXd& reference,
                                const Eigen::VectorXd& weights) {
  const auto num_own = static_cast<std::size_t>(one.cols());
  const auto num_reference = static_cast<std::size_t>(reference.cols());
  const auto distance = [&](std::size_t a, std::size_t b) {
    double sum = 0, num_common = 0;
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      const double difference =
          one(1 + i, static_cast<Eigen::Index>(a)) - reference(1 + i, static_cast<Eigen::Index>(b));
      if (std::isnan(difference)) continue;  // one of the two never has this output
      sum += weights[i] * difference * difference;
      ++num_common;
    }
    return num_common > 0 ? sum * (static_cast<double>(weights.size()) / num_common) : 0;
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<Step> steps(num_own * num_reference);
  std::vector<double> before(num_reference, kFar), now(num_reference);
  for (std::size_t a = 0; a < num_own; ++a) {
    for (std::size_t b = 0; b < num_reference; ++b) {
      // Of equal ways the one that goes on in both: where all is alike, time stays as it is.
      double least = a > 0 && b > 0 ? before[b - 1] : (a == 0 && b == 0 ? 0 : kFar);
      Step step = Step::kBoth;
      if (a > 0 && before[b] < least) least = before[b], step = Step::kOwn;
      if (b > 0 && now[b - 1] < least) least = now[b - 1], step = Step::kReference;
      now[b] = least + distance(a, b);
      steps[a * num_reference + b] = step;
    }
    std::swap(before, now);
  }
  std::vector<double> sums(num_own, 0), counts(num_own, 0);
  for (std::size_t a = num_own - 1, b = num_reference - 1;;) {
    sums[a] += reference(0, static_cast<Eigen::Index>(b));
    ++counts[a];
    if (a == 0 && b == 0) break;
    const Step step = steps[a * num_reference + b];
    if (step != Step::kReference) --a;
    if (step != Step::kOwn) --b;
  }
  Eigen::RowVectorXd times(one.cols());
  for (std::size_t a = 0; a < num_own; ++a)
    times[static_cast<Eigen::Index>(a)] = sums[a] / counts[a];
  return times;
}

}  // namespace

double warped_pairs(const Demonstrations& demonstrations, Alignment alignment) {
  if (alignment != Alignment::kDynamicTimeWarping) return 0;
  const auto reference =
      static_cast<double>(demonstrations[median_duration(demonstrations)].cols());
  double pairs = 0;
  for (const Eigen::MatrixXd& one : demonstrations) {
    pairs += reference * static_cast<double>(one.cols());
  }
  return pairs;
}

void align(Demonstrations& demonstrations, Alignment alignment) {
  if (alignment == Alignment::kNone) return;
  CHECK(demonstrations.size() >= 2, "several demonstrations");
  CHECK(warped_pairs(demonstrations, alignment) <= kWarpedPairsMax, "not too many pairs");
  const std::size_t reference = median_duration(demonstrations);
  scale_to_mean_duration(demonstrations);
  if (alignment == Alignment::kDuration) return;
  const Eigen::VectorXd weights = output_weights(demonstrations);
  const Eigen::MatrixXd clock = interpolated(demonstrations[reference]);
  for (std::size_t k = 0; k < demonstrations.size(); ++k) {
    if (k == reference) continue;
    demonstrations[k].row(0) = warped_times(interpolated(demonstrations[k]), clock, weights);
  }
}

}  // namespace treeroll
