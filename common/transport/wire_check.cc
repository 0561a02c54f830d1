#include "common/transport/wire_check.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

namespace treeroll::transport::wire {
namespace {

/// Length of the UTF-8 sequence at the head of `text`, 0 if there is none (RFC 3629: no overlong
/// forms, no surrogates, nothing past U+10FFFF).
std::size_t utf8_sequence(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < size) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  const unsigned char second = byte(1);
  if (first == 0xe0 && second < 0xa0) return 0;
  if (first == 0xed && second > 0x9f) return 0;
  if (first == 0xf0 && second < 0x90) return 0;
  if (first == 0xf4 && second > 0x8f) return 0;
  return size;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = utf8_sequence(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

}  // namespace

void Checker::fingerprint(std::int64_t expected) {
  const Step step(*this, "fingerprint");
  if (const auto value = integer_of(sizeof expected); value && *value != expected) {
    refuse(fmt::format("{:016x} is not {:016x}: another type, or another version of treeroll",
                       static_cast<std::uint64_t>(*value), static_cast<std::uint64_t>(expected)));
  }
}

void Checker::end() {
  if (at_ < bytes_.size()) {
    refuse(fmt::format("{} bytes follow the last field", bytes_.size() - at_));
  }
}

const std::byte* Checker::take(std::size_t size) {
  if (refusal_) return nullptr;
  if (size > bytes_.size() - at_) {
    refuse(fmt::format("needs {} bytes and {} are left", size, bytes_.size() - at_));
    return nullptr;
  }
  const std::byte* taken = bytes_.data() + at_;
  at_ += size;
  return taken;
}

std::optional<std::int64_t> Checker::integer_of(std::size_t size) {
  const std::byte* taken = take(size);
  if (taken == nullptr) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = value << 8 | std::to_integer<unsigned>(taken[i]);
  const unsigned unused_bits = 64 - 8 * static_cast<unsigned>(size);
  return static_cast<std::int64_t>(value << unused_bits) >> unused_bits;
}

std::optional<std::int64_t> Checker::integer_within(std::size_t size, std::int64_t min,
                                                    std::int64_t max, const char* what) {
  const auto value = integer_of(size);
  if (value && (*value < min || *value > max)) {
    refuse(fmt::format("{}{} is not within {}..{}", what, *value, min, max));
    return std::nullopt;
  }
  return value;
}

std::optional<double> Checker::finite_number() {
  const auto bits = integer_of(sizeof(double));
  if (!bits) return std::nullopt;
  const auto number = std::bit_cast<double>(*bits);
  if (!std::isfinite(number)) refuse(fmt::format("{} is not a finite number", number));
  return number;
}

/// A reward stands beside status ok alone, a reason beside the others.
void Checker::outcome(std::size_t reason_bytes_max) {
  std::optional<double> reward;
  {
    const Step step(*this, "reward");
    reward = finite_number();
  }
  std::optional<std::int64_t> status;
  {
    const Step step(*this, "status");
    status = integer_within(1, 0, kNumRolloutStatuses - 1, "");
    const bool is_zero = reward && std::bit_cast<std::uint64_t>(*reward) == 0;
    if (status && *status != 0 && !is_zero) {
      refuse(fmt::format("{} is not 0, ok, beside a reward of {}", *status, reward.value_or(0)));
    }
  }
  const Step step(*this, "reason");
  const std::size_t size = string(reason_bytes_max);
  if (status == 0 && size > 0) refuse("must be empty beside status ok");
}

std::size_t Checker::string(std::size_t bytes_max) {
  // LCM counts the closing NUL.
  const auto size =
      integer_within(4, 1, static_cast<std::int64_t>(bytes_max) + 1, "length with its NUL ");
  if (!size) return 0;
  const std::byte* taken = take(static_cast<std::size_t>(*size));
  if (taken == nullptr) return 0;
  const std::string_view text(reinterpret_cast<const char*>(taken),
                              static_cast<std::size_t>(*size) - 1);
  if (taken[text.size()] != std::byte{0}) {
    refuse("does not end with a NUL");
  } else if (text.find('\0') != std::string_view::npos) {
    refuse("has a NUL within");
  } else if (!is_utf8(text)) {
    refuse("is not UTF-8");
  }
  return text.size();
}

void Checker::refuse(const std::string& reason) {
  if (refusal_) return;
  std::string path = type_;
  for (std::size_t i = 0; i < depth_; ++i) {
    path += fmt::format(".{}", path_[i].name);
    if (path_[i].index >= 0) path += fmt::format("[{}]", path_[i].index);
  }
  refusal_ = fmt::format("{}: {}", path, reason);
}

}  // namespace treeroll::transport::wire
