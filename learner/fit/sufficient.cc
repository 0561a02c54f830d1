#include "learner/fit/sufficient.h"

#include <fmt/format.h>

#include <cmath>

#include "learner/fit/recordings.h"

namespace treeroll {

double sufficient_error(const Eigen::MatrixXd& data, int input_dim) {
  const double apart = spread_of_recordings(data, input_dim);
  // Of one recording the very number.
  return apart > 0 ? std::sqrt(kSufficientError * kSufficientError + apart * apart)
                   : kSufficientError;
}

void refuse_sizes(const SizeSearch& search, double least, const std::string& refusal) {
  throw FitError(fmt::format(
      "of up to {} {} none come within {:.2g} of the outputs' rms{}, {}: {}", search.sizes.most,
      search.what, search.enough,
      search.enough > kSufficientError ? ", and so of the recordings' mean within a tenth" : "",
      std::isfinite(least) ? fmt::format("the best within {:.2g}", least) : refusal,
      search.way_out));
}

}  // namespace treeroll
