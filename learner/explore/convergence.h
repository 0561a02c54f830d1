#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace treeroll::explore {

/// Slope alpha of the line alpha x + beta fitted by least squares to rewards at x = 1 .. N, thesis
/// (3-7), in reward per roll-out. In closed form: no matrix is built. Exactly 0 for equal rewards,
/// so that a threshold of 0 does not see rounding errors as a decline.
/// @param rewards  oldest first; precondition: at least two
double least_squares_slope(std::span<const double> rewards);

/// The last M rewards: the convergence window of section 3-2-1. Memory does not grow.
class RewardWindow {
 public:
  /// Precondition: capacity (M) is at least 2.
  explicit RewardWindow(int capacity);

  void add(double reward);
  /// At most M rewards, oldest first; valid until the next add().
  std::span<const double> rewards() const;
  /// Slope over the rewards there are, up to M; nothing before two.
  std::optional<double> slope() const;
  std::optional<double> mean() const;

 private:
  // Each reward is written twice, M places apart, so that the last M always lie side by side.
  std::vector<double> twice_;
  std::size_t capacity_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

/// Gain of a layer's best reward so far, per roll-out: over its last M results, and over all of
/// them. Memory does not grow.
class GainWindow {
 public:
  /// Precondition: capacity (M) is at least 1.
  explicit GainWindow(int capacity);

  void add(double reward);
  /// Gain a roll-out over the last M results as a share of that since the layer's first result.
  /// Nothing before M + 1 results, nor while nothing has been gained: a plateau from the start has
  /// no share to fall below.
  std::optional<double> share() const;

 private:
  RewardWindow best_;  // so far, after each of the last M + 1 results
  double first_ = 0;
  double highest_ = 0;
  int capacity_;
  std::int64_t num_results_ = 0;
};

}  // namespace treeroll::explore
