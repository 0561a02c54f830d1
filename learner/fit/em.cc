#include "learner/fit/em.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/numbers/mirrored.h"
#include "common/policy/tree/frame.h"
#include "learner/fit/missing_outputs.h"

namespace treeroll {
namespace {

constexpr double kLogTwoPi = 1.8378770664093453;
/// A component responsible for less than this share of its data has lost them.
constexpr double kShareMin = 1e-9;
/// So many deviations from a mean a log-density is exact to 1e-10.
constexpr double kFarDeviations = 1000;

/// log(pi_k N(x | k)), prepared for many x. Sums are written out: products of large matrices are
/// blocked by the processor's caches, and the order of a sum would depend on the machine.
class LogDensity {
 public:
  explicit LogDensity(const Component& component)
      : mean_(component.mean),
        factor_(cholesky_factor(component.covariance)),
        scaled_(component.mean.size()),
        constant_(elementary::log(component.prior) -
                  .5 * kLogTwoPi * static_cast<double>(component.mean.size())) {
    for (Eigen::Index i = 0; i < mean_.size(); ++i) constant_ -= elementary::log(factor_(i, i));
  }

  /// @param x  d numbers
  double operator()(const double* x) {
    double squared = 0;
    for (Eigen::Index i = 0; i < mean_.size(); ++i) {
      double rest = x[i] - mean_[i];
      for (Eigen::Index j = 0; j < i; ++j) rest -= factor_(i, j) * scaled_[j];
      scaled_[i] = rest / factor_(i, i);
      squared += scaled_[i] * scaled_[i];
    }
    return constant_ - .5 * squared;
  }

 private:
  Eigen::VectorXd mean_;
  Eigen::MatrixXd factor_;
  Eigen::VectorXd scaled_;
  double constant_;
};

struct Expectation {
  Eigen::MatrixXd responsibilities;  ///< K x N
  double mean_log_likelihood = 0;
};

Expectation expect(const Gmm& gmm, const Eigen::MatrixXd& data) {
  CHECK(data.rows() == gmm.dim() && data.cols() > 0, "data are d x N, N > 0");
  const int num_components = gmm.num_components();
  // A sample that lacks outputs counts by the density of those that it has.
  std::map<std::vector<Eigen::Index>, std::vector<LogDensity>> densities_of_rows;
  const auto densities_of = [&](const std::vector<Eigen::Index>& rows) -> std::vector<LogDensity>& {
    std::vector<LogDensity>& densities = densities_of_rows[rows];
    if (!densities.empty()) return densities;
    for (const Component& component : gmm.components()) {
      densities.emplace_back(marginal(component, rows));
    }
    return densities;
  };
  const bool has_all = is_complete(data);
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(data.rows()));
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  std::vector<LogDensity>* densities = &densities_of(rows);
  Eigen::VectorXd sample;
  Expectation result;
  result.responsibilities.resize(num_components, data.cols());
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    double* column = result.responsibilities.col(n).data();
    const double* x = data.col(n).data();
    if (!has_all) {
      rows = rows_of(data.col(n));
      densities = &densities_of(rows);
      sample.resize(static_cast<Eigen::Index>(rows.size()));
      for (std::size_t i = 0; i < rows.size(); ++i) {
        sample[static_cast<Eigen::Index>(i)] = data(rows[i], n);
      }
      x = sample.data();
    }
    double largest = -std::numeric_limits<double>::infinity();
    for (int k = 0; k < num_components; ++k) {
      column[k] = (*densities)[static_cast<std::size_t>(k)](x);
      largest = std::max(largest, column[k]);
    }
    double sum = 0;
    for (int k = 0; k < num_components; ++k) {
      column[k] = elementary::exp(column[k] - largest);
      sum += column[k];
    }
    for (int k = 0; k < num_components; ++k) column[k] /= sum;
    result.mean_log_likelihood += largest + elementary::log(sum);
  }
  result.mean_log_likelihood /= static_cast<double>(data.cols());
  return result;
}

/// The M step for one component; `weight` is the row h_{n,k} of table 3-1.
Component maximise(const Eigen::MatrixXd& data, const Eigen::VectorXd& weight,
                   const Eigen::VectorXd& regularisation) {
  const Eigen::Index dim = data.rows();
  Component component;
  component.mean = Eigen::VectorXd::Zero(dim);
  component.covariance = Eigen::MatrixXd::Zero(dim, dim);
  double weight_sum = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    weight_sum += weight[n];
    for (Eigen::Index i = 0; i < dim; ++i) component.mean[i] += weight[n] * data(i, n);
  }
  component.prior = weight_sum / static_cast<double>(data.cols());
  component.mean /= weight_sum;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    for (Eigen::Index i = 0; i < dim; ++i) {
      const double weighted = weight[n] * (data(i, n) - component.mean[i]);
      for (Eigen::Index j = 0; j <= i; ++j) {
        component.covariance(i, j) += weighted * (data(j, n) - component.mean[j]);
      }
    }
  }
  component.covariance = mirrored(component.covariance / weight_sum);
  component.covariance.diagonal() += regularisation;
  return component;
}

/// A component all of whose samples lack an output knows nothing of it: its numbers would be those
/// that EM began with.
void check_outputs_seen(const Gmm& gmm, const Eigen::MatrixXd& data,
                        const Eigen::VectorXd& parent_responsibility) {
  constexpr double kSeenMin = 1e-3;
  const Eigen::MatrixXd h = expect(gmm, data).responsibilities;
  for (int k = 0; k < gmm.num_components(); ++k) {
    for (Eigen::Index row = gmm.input_dim(); row < data.rows(); ++row) {
      double all = 0, seen = 0;
      for (Eigen::Index n = 0; n < data.cols(); ++n) {
        const double weight = h(k, n) * parent_responsibility[n];
        all += weight;
        if (!std::isnan(data(row, n))) seen += weight;
      }
      if (seen >= kSeenMin * all) continue;
      throw FitError(
          fmt::format("component {} of {} lies where output {} is missing: fewer "
                      "components reach to where it is not",
                      k, gmm.num_components(), row - gmm.input_dim() + 1));
    }
  }
}

bool same(const Gmm& a, const Gmm& b) {
  for (int k = 0; k < a.num_components(); ++k) {
    if (a[k].prior != b[k].prior || a[k].mean != b[k].mean || a[k].covariance != b[k].covariance) {
      return false;
    }
  }
  return true;
}

/// Where the start puts an output's mean: at 0 as the thesis does. All components share it, so it
/// decides nothing, unless the data are so far from it that a squared distance swallows the digits
/// that tell the components apart: then in the middle of the data.
double start_mean(const Eigen::MatrixXd& data, Eigen::Index row, double deviation) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    if (std::isnan(data(row, n))) continue;
    low = std::min(low, data(row, n));
    high = std::max(high, data(row, n));
  }
  const double distance = std::max({low, -high, 0.});
  return distance > kFarDeviations * deviation ? low + .5 * (high - low) : 0;
}

}  // namespace

Gmm equally_spaced(const Eigen::MatrixXd& data, int input_dim, int num_components,
                   double output_deviation) {
  const double start = data.row(0).minCoeff();
  const double share = (data.row(0).maxCoeff() - start) / num_components;
  if (!(share > 0)) throw FitError("the first input of the data does not vary");
  Eigen::VectorXd variance =
      Eigen::VectorXd::Constant(data.rows(), output_deviation * output_deviation);
  variance[0] = .25 * share * share;
  std::vector<Component> components;
  for (int k = 0; k < num_components; ++k) {
    Component component;
    component.prior = 1. / num_components;
    component.mean.resize(data.rows());
    component.mean[0] = start + (k + .5) * share;
    for (Eigen::Index i = 1; i < data.rows(); ++i) {
      component.mean[i] = start_mean(data, i, output_deviation);
    }
    component.covariance = variance.asDiagonal();
    components.push_back(std::move(component));
  }
  return Gmm(input_dim, std::move(components));
}

Gmm fit_children(const Gmm& start, const Eigen::MatrixXd& data,
                 const Eigen::VectorXd& parent_responsibility, const EmSettings& settings) {
  CHECK(settings.regularisation.size() == start.dim(), "the regularisation has d elements");
  CHECK(parent_responsibility.size() == data.cols(), "a parent's responsibility a sample");
  Gmm gmm = start;
  const bool has_all = is_complete(data);
  double share = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) share += parent_responsibility[n];
  share /= static_cast<double>(data.cols());
  for (int iteration = 0; iteration < settings.num_iterations; ++iteration) {
    const Eigen::MatrixXd among_siblings = expect(gmm, data).responsibilities;
    std::vector<Component> components;
    for (int k = 0; k < gmm.num_components(); ++k) {
      const Eigen::VectorXd weight =
          among_siblings.row(k).transpose().cwiseProduct(parent_responsibility);
      Component component;
      if (has_all) {
        component = maximise(data, weight, settings.regularisation);
      } else {
        const Completed whole = completed(gmm[k], data, weight);
        component = maximise(whole.data, weight, settings.regularisation);
        component.covariance = mirrored(component.covariance + whole.left);
      }
      if (!(component.prior > kShareMin * share)) {
        throw LeftWithoutData(fmt::format("component {} of {} is left without data in iteration {}",
                                          k, gmm.num_components(), iteration + 1));
      }
      components.push_back(std::move(component));
    }
    try {
      Gmm next(gmm.input_dim(), std::move(components));
      const bool settled = same(gmm, next);
      gmm = std::move(next);
      if (settled) break;
    } catch (const std::invalid_argument& error) {
      throw FitError(fmt::format("iteration {}: {}", iteration + 1, error.what()));
    }
  }
  if (!has_all) check_outputs_seen(gmm, data, parent_responsibility);
  return gmm;
}

Gmm fit_em(const Gmm& start, const Eigen::MatrixXd& data, const EmSettings& settings) {
  // A parent that is responsible for everything: the two columns of table 3-1 are then one.
  return fit_children(start, data, Eigen::VectorXd::Ones(data.cols()), settings);
}

Eigen::MatrixXd responsibilities(const Gmm& gmm, const Eigen::MatrixXd& data) {
  return expect(gmm, data).responsibilities;
}

double mean_log_likelihood(const Gmm& gmm, const Eigen::MatrixXd& data) {
  return expect(gmm, data).mean_log_likelihood;
}

}  // namespace treeroll
