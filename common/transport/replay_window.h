#pragma once

#include <bitset>
#include <cstdint>

namespace treeroll::transport {

/// Which of a sender's numbered messages have come: each is taken once. What is overtaken by more
/// than kSize others counts as lost.
class ReplayWindow {
 public:
  static constexpr std::int64_t kSize = 1024;

  /// Nothing before `first` is taken.
  explicit ReplayWindow(std::int64_t first) : first_(first), highest_(first - 1) {}

  /// Whether it has not come before; it has now.
  bool take(std::int64_t index) {
    if (index < first_ || index <= highest_ - kSize) return false;
    if (index > highest_) {
      if (index - highest_ >= kSize) seen_.reset();
      for (std::int64_t i = highest_ + 1; i < index && index - highest_ < kSize; ++i) {
        seen_.reset(place(i));
      }
      highest_ = index;
    } else if (seen_.test(place(index))) {
      return false;
    }
    seen_.set(place(index));
    return true;
  }

  std::int64_t highest() const { return highest_; }

 private:
  static std::size_t place(std::int64_t index) { return static_cast<std::size_t>(index % kSize); }

  std::int64_t first_;
  std::int64_t highest_;
  std::bitset<kSize> seen_;
};

}  // namespace treeroll::transport
