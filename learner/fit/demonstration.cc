#include "learner/fit/demonstration.h"

#include <numbers>

#include "common/base/check.h"
#include "common/numbers/elementary.h"

namespace treeroll {

Eigen::MatrixXd demonstrate(const CartAcceleration& settings) {
  CHECK(settings.num_samples >= 2, "a demonstration has two ends");
  const auto& p = settings.p_m;
  const double a1 = -p[1] - p[3];
  const std::array<double, 5> amplitude = {a1, p[0], p[1], p[2], p[3]};
  Eigen::MatrixXd data(2, settings.num_samples);
  for (int n = 0; n < settings.num_samples; ++n) {
    const double time_s = settings.duration_s * n / (settings.num_samples - 1);
    double acceleration_mps2 = 0;
    for (int i = 1; i <= 5; ++i) {
      // (4-5): the second derivative of the i-th cosine of (4-4).
      const double frequency = i * std::numbers::pi / settings.duration_s;
      acceleration_mps2 -= frequency * frequency * amplitude[static_cast<std::size_t>(i - 1)] *
                           elementary::cos(frequency * time_s);
    }
    data(0, n) = time_s;
    data(1, n) = acceleration_mps2;
  }
  return data;
}

}  // namespace treeroll
