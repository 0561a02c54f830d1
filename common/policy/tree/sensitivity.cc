#include "common/policy/tree/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/mixture/gmr.h"
#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

constexpr double kDeviations[] = {-1.5, -1, -.5, 0, .5, 1, 1.5};
/// An element that moves the output by less of what it might moves nothing: its step is bounded,
/// those of others are theirs to the bit.
constexpr double kNothing = 1e-3;
/// Of the strongest element in the output's unit.
constexpr double kLeastShare = .1;

struct WeightedInput {
  double weight;
  Eigen::VectorXd input;
};

/// So many inputs are enough: all of several hundred Gaussians would take minutes.
constexpr std::size_t kCloudMax = 512;

/// Spread over all Gaussians. Of more than kCloudMax every second, third ... but never every
/// seventh: the deviations recur with that period, and each of them is to be met.
std::vector<WeightedInput> inputs_of(const Gmm& gmm) {
  const int num_inputs = gmm.input_dim();
  std::vector<WeightedInput> inputs;
  for (const Component& component : gmm.components()) {
    const Eigen::MatrixXd factor =
        cholesky_factor(component.covariance.topLeftCorner(num_inputs, num_inputs));
    for (int axis = 0; axis < num_inputs; ++axis) {
      for (const double deviations : kDeviations) {
        inputs.push_back(
            {component.prior, component.mean.head(num_inputs) + deviations * factor.col(axis)});
      }
    }
  }
  if (inputs.size() <= kCloudMax) return inputs;
  std::size_t stride = (inputs.size() + kCloudMax - 1) / kCloudMax;
  if (stride % std::size(kDeviations) == 0) ++stride;
  std::vector<WeightedInput> spread;
  for (std::size_t i = 0; i < inputs.size(); i += stride) spread.push_back(inputs[i]);
  return spread;
}

/// Inputs where the policy acts, dI x N.
Eigen::MatrixXd spread_inputs(const Gmm& gmm) {
  constexpr int kInputs = 201;
  constexpr double kReach = 2;  // standard deviations
  if (gmm.input_dim() > 1) {
    const std::vector<WeightedInput> cloud = inputs_of(gmm);
    Eigen::MatrixXd inputs(gmm.input_dim(), static_cast<Eigen::Index>(cloud.size()));
    for (std::size_t n = 0; n < cloud.size(); ++n) {
      inputs.col(static_cast<Eigen::Index>(n)) = cloud[n].input;
    }
    return inputs;
  }
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const Component& component : gmm.components()) {
    const double reach = kReach * std::sqrt(component.covariance(0, 0));
    low = std::min(low, component.mean[0] - reach);
    high = std::max(high, component.mean[0] + reach);
  }
  return Eigen::RowVectorXd::LinSpaced(kInputs, low, high);
}

/// Outputs at several inputs, dO x N.
Eigen::MatrixXd regress_all(const Gmr& gmr, const Eigen::MatrixXd& inputs) {
  Eigen::MatrixXd outputs(gmr.output_dim(), inputs.cols());
  Gmr::WorkSpace work = gmr.work_space();
  gmr.regress_all({inputs.data(), static_cast<std::size_t>(inputs.size())}, work,
                  {outputs.data(), static_cast<std::size_t>(outputs.size())});
  return outputs;
}

/// How far an element is moved for a difference: half of the digits for the step, the others for
/// the difference it makes.
double difference_step(double element) { return 1e-5 * std::max(1e-3, std::abs(element)); }

/// PolicyEffect::least of the explored layer.
Eigen::VectorXd least_effect(const TreePolicy& policy) {
  const Gmm gmm = policy.tree().layer(policy.layer());
  // Where a mean input stands in a component's theta is the layout's business: it is found by what
  // moves.
  std::vector<Component> moved = gmm.components();
  for (Component& component : moved) component.mean.head(gmm.input_dim()).array() += 1;
  const Eigen::VectorXd difference =
      to_theta(policy.layout(), Gmm(gmm.input_dim(), std::move(moved))) - policy.theta();
  const Eigen::Index size = difference.size() / gmm.num_components();
  Eigen::VectorXd least = Eigen::VectorXd::Zero(difference.size());
  for (int k = 0; k < gmm.num_components(); ++k) {
    for (Eigen::Index i = 0; i < gmm.input_dim() && i < size; ++i) {
      if (difference[k * size + i] > .5) {
        least[k * size + i] = 2 / std::sqrt(gmm[k].covariance(i, i));
      }
    }
  }
  return least;
}

struct Expected {
  Eigen::VectorXd most;     ///< what each element might move the output
  Eigen::VectorXd instead;  ///< what it counts as where it moves nothing
};

Expected expected(const TreePolicy& policy, const Eigen::VectorXd& rms,
                  const std::vector<WeightedInput>& inputs) {
  const Gmm finest = policy.tree().finest();
  const Gmr gmr(finest);
  double size = 0;  // of the outputs, and of their spread where all are 0
  double weight_sum = 0;
  for (const WeightedInput& at : inputs) {
    size += at.weight * gmr.regress(at.input).squaredNorm();
    weight_sum += at.weight;
  }
  size = std::sqrt(size / weight_sum);
  const int num_outputs = finest.output_dim();
  for (const Component& component : finest.components()) {
    // Around its line: the spread along it is what the Gaussian does.
    const Eigen::MatrixXd around =
        cholesky_factor(component.covariance).bottomRightCorner(num_outputs, num_outputs);
    size = std::max(size, around.rowwise().norm().maxCoeff());
  }
  const Eigen::VectorXd least = least_effect(policy);
  double largest = 0;
  for (Eigen::Index i = 0; i < rms.size(); ++i) {
    if (least[i] == 0) largest = std::max(largest, rms[i]);
  }
  Expected expected{Eigen::VectorXd(rms.size()), Eigen::VectorXd(rms.size())};
  for (Eigen::Index i = 0; i < rms.size(); ++i) {
    const bool is_mean_input = least[i] != 0;
    expected.most[i] = is_mean_input ? least[i] * size : largest;
    // A share of what a mean input might move would be a step past its neighbours.
    expected.instead[i] = is_mean_input ? expected.most[i] : kLeastShare * largest;
  }
  return expected;
}

/// A policy with one number of theta a little larger, and a little smaller: a central difference.
struct Moved {
  Gmr ahead;
  Gmr behind;
  double distance;
};

Moved moved(const TreePolicy& policy, const Eigen::VectorXd& theta, Eigen::Index i) {
  const double step = difference_step(theta[i]);
  Eigen::VectorXd ahead = theta;
  Eigen::VectorXd behind = theta;
  ahead[i] += step;
  behind[i] -= step;
  return {Gmr(policy.decode(ahead)), Gmr(policy.decode(behind)), ahead[i] - behind[i]};
}

}  // namespace

Eigen::VectorXd sensitivity_scale(const TreePolicy& policy) {
  const Eigen::VectorXd theta = policy.theta();
  const std::vector<WeightedInput> inputs = inputs_of(policy.tree().finest());
  double weight_sum = 0;
  for (const WeightedInput& at : inputs) weight_sum += at.weight;

  Eigen::VectorXd rms(theta.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const auto [ahead, behind, distance] = moved(policy, theta, i);
    double sum = 0;
    for (const WeightedInput& at : inputs) {
      const Eigen::VectorXd change = ahead.regress(at.input) - behind.regress(at.input);
      sum += at.weight * change.squaredNorm();
    }
    rms[i] = std::sqrt(sum / weight_sum) / distance;
  }
  CHECK(rms.allFinite() && rms.maxCoeff() > 0, "a policy whose output nothing moves");
  const auto [most, instead] = expected(policy, rms, inputs);
  const auto moves_nothing = (rms.array() < kNothing * most.array());
  return moves_nothing.select(instead, rms).cwiseInverse();
}

PolicyEffect tree_effect(const TreePolicy& policy) {
  const Eigen::VectorXd theta = policy.theta();
  const Gmm finest = policy.tree().finest();
  const Eigen::MatrixXd inputs = spread_inputs(finest);
  PolicyEffect effect;
  effect.outputs = regress_all(Gmr(finest), inputs).transpose();
  effect.derivative.resize(effect.outputs.size(), theta.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const auto [ahead, behind, distance] = moved(policy, theta, i);
    effect.derivative.col(i) =
        ((regress_all(ahead, inputs) - regress_all(behind, inputs)) / distance).reshaped();
  }
  effect.least = least_effect(policy);
  return effect;
}

}  // namespace treeroll
