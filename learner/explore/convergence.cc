#include "learner/explore/convergence.h"

#include <algorithm>

#include "common/base/check.h"

namespace treeroll::explore {

double least_squares_slope(std::span<const double> rewards) {
  const std::size_t n = rewards.size();
  CHECK(n >= 2, "a slope needs two rewards");
  const double count = static_cast<double>(n);
  // alpha = sum (x - mean x) r / sum (x - mean x)^2. The weights of the i-th and the i-th last are
  // opposite: taken in pairs, equal rewards cancel exactly.
  double numerator = 0;
  for (std::size_t i = 0; i < n / 2; ++i) {
    const double weight = (count - 1) / 2 - static_cast<double>(i);
    numerator += weight * (rewards[n - 1 - i] - rewards[i]);
  }
  const double sum_of_squares = count * (count * count - 1) / 12;
  return numerator / sum_of_squares;
}

RewardWindow::RewardWindow(int capacity) : capacity_(static_cast<std::size_t>(capacity)) {
  CHECK(capacity >= 2, "a convergence window holds at least two rewards");
  twice_.resize(2 * capacity_);
}

void RewardWindow::add(double reward) {
  twice_[next_] = reward;
  twice_[next_ + capacity_] = reward;
  next_ = (next_ + 1) % capacity_;
  if (size_ < capacity_) ++size_;
}

std::span<const double> RewardWindow::rewards() const {
  // Until it is full the oldest reward is at the start, afterwards where the next will go.
  const std::size_t oldest = size_ < capacity_ ? 0 : next_;
  return std::span(twice_).subspan(oldest, size_);
}

std::optional<double> RewardWindow::slope() const {
  if (size_ < 2) return std::nullopt;
  return least_squares_slope(rewards());
}

std::optional<double> RewardWindow::mean() const {
  if (size_ < 2) return std::nullopt;
  double sum = 0;
  for (const double reward : rewards()) sum += reward;
  return sum / static_cast<double>(size_);
}

GainWindow::GainWindow(int capacity) : best_(capacity + 1), capacity_(capacity) {
  CHECK(capacity >= 1, "a gain is over at least one roll-out");
}

void GainWindow::add(double reward) {
  if (num_results_ == 0) first_ = highest_ = reward;
  highest_ = std::max(highest_, reward);
  best_.add(highest_);
  ++num_results_;
}

std::optional<double> GainWindow::share() const {
  if (num_results_ <= capacity_ || highest_ <= first_) return std::nullopt;
  const double recent = (highest_ - best_.rewards().front()) / static_cast<double>(capacity_);
  const double average = (highest_ - first_) / static_cast<double>(num_results_ - 1);
  return recent / average;
}

}  // namespace treeroll::explore
