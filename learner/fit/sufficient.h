#pragma once

#include <algorithm>
#include <limits>
#include <string>

#include "learner/fit/em.h"

namespace treeroll {

/// Relative error of a start that is close enough for learning: how many components or functions
/// it has goes by this where a study leaves that open.
inline constexpr double kSufficientError = .1;

/// Sizes to try: first, first + step, ... up to most.
struct SizeRange {
  int first;
  int step;
  int most;
};

template <typename Start>
struct Fitted {
  Start start;
  double relative_error;  ///< relative_rms() of its outputs
};

/// Throws FitError: how close the best of them came, or why there is none.
[[noreturn]] void refuse_sizes(int most, const char* what, double least,
                               const std::string& refusal);

/// The fit of the smallest size that comes within kSufficientError of the demonstration. A size
/// that has no fit is passed over. Throws FitError where none is close enough.
/// @param what  sizes count: "components"
/// @param fit   size -> Fitted; may throw FitError
template <typename Fit>
auto smallest_sufficient(const SizeRange& sizes, const char* what, const Fit& fit)
    -> decltype(fit(sizes.first).start) {
  double least = std::numeric_limits<double>::infinity();
  std::string refusal;
  for (int size = sizes.first; size <= sizes.most; size += sizes.step) {
    try {
      auto fitted = fit(size);
      if (fitted.relative_error <= kSufficientError) return std::move(fitted.start);
      least = std::min(least, fitted.relative_error);
    } catch (const FitError& error) {
      refusal = error.what();
    }
  }
  refuse_sizes(sizes.most, what, least, refusal);
}

}  // namespace treeroll
