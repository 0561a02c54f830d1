#include "common/mixture/gmr.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/mixture/gmr_lanes.h"
#include "common/numbers/elementary.h"
#include "common/numbers/mirrored.h"
#include "common/numbers/processor.h"

namespace treeroll {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();

constexpr std::size_t kWidthMax = 8;

double bounded(double input) { return std::clamp(input, -kGmmMagnitudeMax, kGmmMagnitudeMax); }

void gmr_regress_1(const gmr_kernel::Lines& lines, const double* inputs, double* weights,
                   double* outputs) {
  gmr_kernel::regress(lines, *inputs, weights, [&](int o, double number) { outputs[o] = number; });
}

std::pair<std::size_t, GmrLanes> widest() {
  switch (widest_lanes()) {
    case 8:
      return {8, &gmr_regress_8};
    case 4:
      return {4, &gmr_regress_4};
    case 2:
      return {2, &gmr_regress_2};
    default:
      return {1, &gmr_regress_1};
  }
}

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
    if (input_dim_ == 1) {
      LineMixture& lines = line_mixture_;
      lines.mean_input.push_back(prepared.mean_input[0]);
      lines.precision.push_back(1 / prepared.factor_input(0, 0));
      lines.log_weight.push_back(prepared.log_weight);
      lines.slope.insert(lines.slope.end(), prepared.slope.data(),
                         prepared.slope.data() + output_dim_);
      lines.mean_output.insert(lines.mean_output.end(), prepared.mean_output.data(),
                               prepared.mean_output.data() + output_dim_);
    }
    prepared_.push_back(std::move(prepared));
  }
}

gmr_kernel::Lines Gmr::lines() const {
  const LineMixture& lines = line_mixture_;
  return {.num_components = static_cast<int>(lines.mean_input.size()),
          .output_dim = output_dim_,
          .mean_input = lines.mean_input.data(),
          .precision = lines.precision.data(),
          .log_weight = lines.log_weight.data(),
          .slope = lines.slope.data(),
          .mean_output = lines.mean_output.data()};
}

double Gmr::regress(double input) const {
  CHECK(input_dim_ == 1 && output_dim_ == 1, "regress(double) is for one input and one output");
  double output = 0;
  WorkSpace work = work_space();
  regress({&input, 1}, work, {&output, 1});
  return output;
}

Gmr::WorkSpace Gmr::work_space() const {
  WorkSpace work;
  work.input.resize(input_dim_);
  work.difference.resize(input_dim_);
  work.conditional.resize(output_dim_);
  work.weights.setZero(num_components_);
  work.log_densities.resize(prepared_.size());
  work.mean.resize(output_dim_);
  work.lanes.resize(prepared_.size() * kWidthMax);
  return work;
}

void Gmr::take_weights(WorkSpace& work) const {
  double largest = kNothing;
  for (std::size_t i = 0; i < prepared_.size(); ++i) {
    const Prepared& prepared = prepared_[i];
    work.difference = work.input - prepared.mean_input;
    prepared.factor_input.triangularView<Eigen::Lower>().solveInPlace(work.difference);
    work.log_densities[i] = prepared.log_weight - .5 * work.difference.squaredNorm();
    largest = std::max(largest, work.log_densities[i]);
  }
  double sum = 0;
  for (std::size_t i = 0; i < prepared_.size(); ++i) {
    const double weight = elementary::exp(work.log_densities[i] - largest);
    work.weights[prepared_[i].component] = weight;
    sum += weight;
  }
  work.weights /= sum;
}

void Gmr::take_conditional_mean(const Prepared& prepared, WorkSpace& work) const {
  work.difference = work.input - prepared.mean_input;
  work.conditional = prepared.mean_output;
  work.conditional.noalias() += prepared.slope * work.difference;
}

void Gmr::regress(std::span<const double> input, WorkSpace& work, std::span<double> output) const {
  CHECK(static_cast<int>(input.size()) == input_dim_ &&
            static_cast<int>(output.size()) == output_dim_,
        "an input and an output have the mixture's dimensions");
  if (input_dim_ == 1) {
    const double one = bounded(input[0]);
    gmr_regress_1(lines(), &one, work.lanes.data(), output.data());
    return;
  }
  for (int i = 0; i < input_dim_; ++i) work.input[i] = bounded(input[static_cast<std::size_t>(i)]);
  take_weights(work);
  work.mean.setZero();
  for (const Prepared& prepared : prepared_) {
    const double weight = work.weights[prepared.component];
    if (weight == 0) continue;
    take_conditional_mean(prepared, work);
    work.mean += weight * work.conditional;
  }
  std::copy(work.mean.begin(), work.mean.end(), output.begin());
}

void Gmr::regress_all(std::span<const double> inputs, WorkSpace& work,
                      std::span<double> outputs) const {
  const auto input_dim = static_cast<std::size_t>(input_dim_);
  const auto output_dim = static_cast<std::size_t>(output_dim_);
  const std::size_t num_inputs = inputs.size() / input_dim;
  CHECK(inputs.size() == num_inputs * input_dim && outputs.size() == num_inputs * output_dim,
        "an output for each input");
  std::size_t i = 0;
  if (input_dim == 1) {
    const auto [width, regress_lanes] = widest();
    std::array<double, kWidthMax> some{};
    for (; i + width <= num_inputs; i += width) {
      std::transform(inputs.data() + i, inputs.data() + i + width, some.begin(), &bounded);
      regress_lanes(lines(), some.data(), work.lanes.data(), outputs.data() + i * output_dim);
    }
  }
  for (; i < num_inputs; ++i) {
    regress(inputs.subspan(i * input_dim, input_dim), work,
            outputs.subspan(i * output_dim, output_dim));
  }
}

Eigen::VectorXd Gmr::regress(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  WorkSpace work = work_space();
  Eigen::VectorXd output(output_dim_);
  regress(std::span(input.data(), static_cast<std::size_t>(input.size())), work,
          std::span(output.data(), static_cast<std::size_t>(output.size())));
  return output;
}

Eigen::VectorXd Gmr::weights(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  CHECK(input.size() == input_dim_, "an input has the mixture's number of inputs");
  WorkSpace work = work_space();
  work.input = input.unaryExpr(&bounded);
  take_weights(work);
  return work.weights;
}

Eigen::MatrixXd Gmr::variance(const Eigen::Ref<const Eigen::VectorXd>& input,
                              VarianceKind kind) const {
  const Eigen::VectorXd mean = regress(input);
  WorkSpace work = work_space();
  work.input = input.unaryExpr(&bounded);
  take_weights(work);
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(output_dim_, output_dim_);
  for (const Prepared& prepared : prepared_) {
    const double weight = work.weights[prepared.component];
    if (weight == 0) continue;
    if (kind == VarianceKind::kAsPrinted) {
      variance += weight * weight * prepared.conditional_covariance;
    } else {
      // Deviations from the common mean: the same sum, without the cancellation.
      take_conditional_mean(prepared, work);
      const Eigen::VectorXd deviation = work.conditional - mean;
      variance += weight * (prepared.conditional_covariance + deviation * deviation.transpose());
    }
  }
  return variance;
}

}  // namespace treeroll
