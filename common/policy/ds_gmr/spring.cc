#include "common/policy/ds_gmr/spring.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll {

Eigen::MatrixXd pulled_along(const Eigen::MatrixXd& attractor, double step, double stiffness) {
  CHECK(attractor.cols() >= 1 && step > 0 && stiffness > 0, "nothing is pulled so");
  const double rate = std::sqrt(stiffness);
  const double decay = elementary::exp(-rate * step);
  Eigen::MatrixXd pulled(attractor.rows(), attractor.cols());
  pulled.col(0) = attractor.col(0);
  Eigen::VectorXd velocity = Eigen::VectorXd::Zero(attractor.rows());
  for (Eigen::Index n = 1; n < attractor.cols(); ++n) {
    for (Eigen::Index o = 0; o < attractor.rows(); ++o) {
      // Along uhat = from + slope s: u = uhat - 2 slope / rate + (offset + drift s) exp(-rate s).
      const double from = attractor(o, n - 1);
      const double slope = (attractor(o, n) - from) / step;
      const double lag = 2 * slope / rate;
      const double offset = pulled(o, n - 1) - from + lag;
      const double drift = velocity[o] - slope + rate * offset;
      const double apart = (offset + drift * step) * decay;
      pulled(o, n) = attractor(o, n) - lag + apart;
      velocity[o] = slope + drift * decay - rate * apart;
    }
  }
  return pulled;
}

Eigen::MatrixXd attractor_of(const Eigen::MatrixXd& recording, double stiffness) {
  const Eigen::Index num_samples = recording.cols();
  CHECK(num_samples >= 3 && stiffness > 0, "a parabola needs three samples");
  const double damping = 2 * std::sqrt(stiffness);
  Eigen::MatrixXd attractor = recording;
  for (Eigen::Index n = 0; n < num_samples; ++n) {
    const Eigen::Index middle = std::clamp<Eigen::Index>(n, 1, num_samples - 2);
    const double before = recording(0, middle - 1);
    const double at = recording(0, middle);
    const double after = recording(0, middle + 1);
    for (Eigen::Index o = 1; o < recording.rows(); ++o) {
      const double rise = (recording(o, middle) - recording(o, middle - 1)) / (at - before);
      const double next_rise = (recording(o, middle + 1) - recording(o, middle)) / (after - at);
      const double bend = (next_rise - rise) / (after - before);
      const double velocity = rise + bend * (2 * recording(0, n) - before - at);
      attractor(o, n) += (2 * bend + damping * velocity) / stiffness;
    }
  }
  return attractor;
}

}  // namespace treeroll
