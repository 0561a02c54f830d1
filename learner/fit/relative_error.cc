#include "learner/fit/relative_error.h"

#include <cmath>

namespace treeroll {

Eigen::VectorXd output_units(const Eigen::MatrixXd& outputs) {
  Eigen::VectorXd unit(outputs.rows());
  for (Eigen::Index o = 0; o < outputs.rows(); ++o) {
    double sum = 0, count = 0;
    for (Eigen::Index n = 0; n < outputs.cols(); ++n) {
      if (std::isnan(outputs(o, n))) continue;
      sum += outputs(o, n) * outputs(o, n);
      ++count;
    }
    unit[o] = sum > 0 ? std::sqrt(sum / count) : 1;
  }
  return unit;
}

double relative_rms(const Eigen::MatrixXd& curve, const Eigen::MatrixXd& outputs) {
  const Eigen::VectorXd unit = output_units(outputs);
  double sum = 0, count = 0;
  for (Eigen::Index n = 0; n < outputs.cols(); ++n) {
    for (Eigen::Index o = 0; o < outputs.rows(); ++o) {
      if (std::isnan(outputs(o, n))) continue;
      const double error = (curve(o, n) - outputs(o, n)) / unit[o];
      sum += error * error;
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace treeroll
