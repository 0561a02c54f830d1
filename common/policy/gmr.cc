#include "common/policy/gmr.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/base/elementary.h"

namespace treeroll {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();

double bounded(double input) { return std::clamp(input, -kGmmMagnitudeMax, kGmmMagnitudeMax); }

}  // namespace

Gmr::Gmr(const Gmm& gmm)
    : input_dim_(gmm.input_dim()),
      output_dim_(gmm.output_dim()),
      num_components_(gmm.num_components()) {
  for (int k = 0; k < num_components_; ++k) {
    const Component& component = gmm[k];
    if (component.prior == 0) continue;
    const Eigen::MatrixXd s_oi = component.covariance.bottomLeftCorner(output_dim_, input_dim_);
    const Eigen::LLT<Eigen::MatrixXd> s_ii(
        component.covariance.topLeftCorner(input_dim_, input_dim_));
    CHECK(s_ii.info() == Eigen::Success, "a Gmm holds positive definite covariances");

    Prepared prepared;
    prepared.component = k;
    prepared.mean_input = component.mean.head(input_dim_);
    prepared.mean_output = component.mean.tail(output_dim_);
    prepared.factor_input = s_ii.matrixL();
    prepared.slope = s_ii.solve(s_oi.transpose()).transpose();
    prepared.conditional_covariance =
        mirrored(component.covariance.bottomRightCorner(output_dim_, output_dim_) -
                 prepared.slope * s_oi.transpose());
    // The factor (2 pi)^(-dI/2) is common to all components and cancels in.
    prepared.log_weight = elementary::log(component.prior);
    for (int i = 0; i < input_dim_; ++i) {
      prepared.log_weight -= elementary::log(prepared.factor_input(i, i));
    }
    if (input_dim_ == 1 && output_dim_ == 1) {
      lines_.push_back({prepared.mean_input[0], prepared.factor_input(0, 0), prepared.slope(0, 0),
                        prepared.mean_output[0], prepared.log_weight});
    }
    prepared_.push_back(std::move(prepared));
  }
}

double Gmr::regress(double input) const {
  CHECK(!lines_.empty(), "regress(double) is for one input and one output");
  const double x = bounded(input);
  const auto log_density = [x](const Line& line) {
    const double distance = (x - line.mean_input) / line.deviation_input;
    return line.log_weight - .5 * distance * distance;
  };
  // Log-sum-exp over two passes: the density is cheaper to have twice than to keep.
  double largest = kNothing;
  for (const Line& line : lines_) largest = std::max(largest, log_density(line));
  double weight_sum = 0;
  double output_sum = 0;
  for (const Line& line : lines_) {
    const double weight = elementary::exp(log_density(line) - largest);
    if (weight == 0) continue;
    weight_sum += weight;
    output_sum += weight * (line.mean_output + line.slope * (x - line.mean_input));
  }
  return output_sum / weight_sum;
}

Eigen::VectorXd Gmr::weights(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  CHECK(input.size() == input_dim_, "an input has the mixture's number of inputs");
  const Eigen::VectorXd x = input.unaryExpr(&bounded);
  std::vector<double> log_densities;
  log_densities.reserve(prepared_.size());
  double largest = kNothing;
  for (const Prepared& prepared : prepared_) {
    const Eigen::VectorXd distance =
        prepared.factor_input.triangularView<Eigen::Lower>().solve(x - prepared.mean_input);
    log_densities.push_back(prepared.log_weight - .5 * distance.squaredNorm());
    largest = std::max(largest, log_densities.back());
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(num_components_);
  double sum = 0;
  for (std::size_t i = 0; i < prepared_.size(); ++i) {
    const double weight = elementary::exp(log_densities[i] - largest);
    weights[prepared_[i].component] = weight;
    sum += weight;
  }
  return weights / sum;
}

Eigen::VectorXd Gmr::conditional_mean(const Prepared& prepared,
                                      const Eigen::VectorXd& input) const {
  return prepared.mean_output + prepared.slope * (input - prepared.mean_input);
}

Eigen::VectorXd Gmr::regress(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  CHECK(input.size() == input_dim_, "an input has the mixture's number of inputs");
  if (!lines_.empty()) return Eigen::VectorXd::Constant(1, regress(input[0]));
  const Eigen::VectorXd x = input.unaryExpr(&bounded);
  const Eigen::VectorXd h = weights(x);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(output_dim_);
  for (const Prepared& prepared : prepared_) {
    if (h[prepared.component] == 0) continue;
    mean += h[prepared.component] * conditional_mean(prepared, x);
  }
  return mean;
}

Eigen::MatrixXd Gmr::variance(const Eigen::Ref<const Eigen::VectorXd>& input,
                              VarianceKind kind) const {
  const Eigen::VectorXd x = input.unaryExpr(&bounded);
  const Eigen::VectorXd h = weights(x);
  const Eigen::VectorXd mean = regress(x);
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(output_dim_, output_dim_);
  for (const Prepared& prepared : prepared_) {
    const double weight = h[prepared.component];
    if (weight == 0) continue;
    if (kind == VarianceKind::kAsPrinted) {
      variance += weight * weight * prepared.conditional_covariance;
    } else {
      // Deviations from the common mean: the same sum, without the cancellation.
      const Eigen::VectorXd deviation = conditional_mean(prepared, x) - mean;
      variance += weight * (prepared.conditional_covariance + deviation * deviation.transpose());
    }
  }
  return variance;
}

}  // namespace treeroll
