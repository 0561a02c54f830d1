#include "learner/fit/sufficient.h"

#include <fmt/format.h>

#include <cmath>

namespace treeroll {

void refuse_sizes(int most, const char* what, double least, const std::string& refusal) {
  throw FitError(
      fmt::format("of up to {} {} none come within {} of the outputs' rms, {}: say how many there "
                  "are to be",
                  most, what, kSufficientError,
                  std::isfinite(least) ? fmt::format("the best within {:.2g}", least) : refusal));
}

}  // namespace treeroll
