#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <string>

#include "learner/fit/em.h"

namespace treeroll {

/// Relative error of a start that is close enough for learning: how many components or functions
/// it has goes by this where a study leaves that open.
inline constexpr double kSufficientError = .1;

/// The same of these data. Several recordings lie apart, and a curve can be near all of them only
/// as their mean is: then what is asked is to come as near to that mean. Squares of errors add up.
/// @param data  d x N, inputs over outputs
double sufficient_error(const Eigen::MatrixXd& data, int input_dim);

/// Sizes to try: first, first + step, ... up to most.
struct SizeRange {
  int first;
  int step;
  int most;
};

/// A search for the smallest size that will do.
struct SizeSearch {
  SizeRange sizes;
  const char* what;  ///< sizes count: "components"
  double enough = kSufficientError;
  std::string way_out = "say how many there are to be";  ///< where none will
};

template <typename Start>
struct Fitted {
  Start start;
  double relative_error;  ///< relative_rms() of its outputs
};

/// Throws FitError: how close the best of them came, or why there is none.
[[noreturn]] void refuse_sizes(const SizeSearch& search, double least, const std::string& refusal);

/// The fit of the smallest size that comes near enough to the demonstration. A size that has no fit
/// is passed over. Throws FitError where none is close enough.
/// @param fit   size -> Fitted; may throw FitError
template <typename Fit>
auto smallest_sufficient(const SizeSearch& search, const Fit& fit)
    -> decltype(fit(search.sizes.first).start) {
  double least = std::numeric_limits<double>::infinity();
  std::string refusal;
  for (int size = search.sizes.first; size <= search.sizes.most; size += search.sizes.step) {
    try {
      auto fitted = fit(size);
      if (fitted.relative_error <= search.enough) return std::move(fitted.start);
      least = std::min(least, fitted.relative_error);
    } catch (const FitError& error) {
      refusal = error.what();
    }
  }
  refuse_sizes(search, least, refusal);
}

}  // namespace treeroll
