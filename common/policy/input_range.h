#pragma once

namespace treeroll {

/// Whether a policy can lie over the inputs from low to high. In a shorter range the space between
/// two functions has lost its digits, and a division by it gives no number. In a longer one a
/// multiple of the length overflows.
inline bool is_input_range(double low, double high) {
  return high - low >= 1e-300 && high - low <= 1e300;
}
inline constexpr const char* kInputRangeRule = "must begin before it ends, by 1e-300 to 1e300";

}  // namespace treeroll
