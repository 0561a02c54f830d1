#include "common/mixture/gmm.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/numbers/mirrored.h"

namespace treeroll {
namespace {

/// Difference of mirrored entries that still counts as rounding, relative to the deviations.
constexpr double kAsymmetryMax = 1e-9;

[[noreturn]] void refuse_component(int component, const std::string& rule) {
  throw std::invalid_argument(fmt::format("component {}: {}", component, rule));
}

bool is_symmetric(const Eigen::MatrixXd& covariance) {
  for (Eigen::Index column = 0; column < covariance.cols(); ++column) {
    for (Eigen::Index row = column + 1; row < covariance.rows(); ++row) {
      const double scale = std::sqrt(covariance(row, row)) * std::sqrt(covariance(column, column));
      const double difference = covariance(row, column) - covariance(column, row);
      if (!(std::abs(difference) <= kAsymmetryMax * scale)) return false;
    }
  }
  return true;
}

void check(const Component& component, int index, Eigen::Index dim) {
  if (component.mean.size() != dim) {
    refuse_component(
        index, fmt::format("the mean has {} elements, must have {}", component.mean.size(), dim));
  }
  if (component.covariance.rows() != dim || component.covariance.cols() != dim) {
    refuse_component(
        index, fmt::format("the covariance is {} x {}, must be {} x {}",
                           component.covariance.rows(), component.covariance.cols(), dim, dim));
  }
  // Written so that NaN fails too.
  if (!(component.prior >= 0 && component.prior <= kGmmMagnitudeMax)) {
    refuse_component(
        index, fmt::format("the prior is {}, must be finite and not negative", component.prior));
  }
  for (Eigen::Index i = 0; i < dim; ++i) {
    if (!(std::abs(component.mean[i]) <= kGmmMagnitudeMax)) {
      refuse_component(index,
                       fmt::format("element {} of the mean is {}, must be finite and at most {}", i,
                                   component.mean[i], kGmmMagnitudeMax));
    }
    const double variance = component.covariance(i, i);
    if (!(variance >= kGmmVarianceMin && variance <= kGmmMagnitudeMax)) {
      refuse_component(index, fmt::format("variance {} is {}, must be from {} to {}", i, variance,
                                          kGmmVarianceMin, kGmmMagnitudeMax));
    }
  }
  if (!is_symmetric(component.covariance))
    refuse_component(index, "the covariance must be symmetric");
}

}  // namespace

Gmm::Gmm(int input_dim, std::vector<Component> components)
    : input_dim_(input_dim), components_(std::move(components)) {
  if (components_.empty()) throw std::invalid_argument("a mixture needs at least one component");
  const Eigen::Index dim = components_[0].mean.size();
  if (input_dim < 1 || input_dim >= dim) {
    throw std::invalid_argument(
        fmt::format("the number of inputs is {}, must be at least 1 and less than the dimension {}",
                    input_dim, dim));
  }
  bool any_prior = false;
  for (int k = 0; k < num_components(); ++k) {
    Component& component = components_[static_cast<std::size_t>(k)];
    check(component, k, dim);
    component.covariance = mirrored(component.covariance);
    if (Eigen::LLT<Eigen::MatrixXd>(component.covariance).info() != Eigen::Success) {
      refuse_component(k, "the covariance must be positive definite");
    }
    any_prior = any_prior || component.prior > 0;
  }
  if (!any_prior) throw std::invalid_argument("at least one prior must be greater than 0");
}

}  // namespace treeroll
