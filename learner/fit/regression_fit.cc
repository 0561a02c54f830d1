#include "learner/fit/regression_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "common/numbers/mirrored.h"
#include "common/policy/tree/frame.h"
#include "learner/fit/relative_error.h"

namespace treeroll {
namespace {

constexpr double kDeviationMin = 1. / 70;  // of an input's range
constexpr double kDeviationMax = 1.4;

/// A component as the numbers that are fitted: mean of the inputs, mean of the outputs, psi row by
/// row, the lower triangle of L_II row by row with log(L_ii), log(pi).
struct Line {
  Eigen::VectorXd mean_input;
  Eigen::VectorXd mean_output;
  Eigen::MatrixXd psi;     // dO x dI
  Eigen::MatrixXd factor;  // dI x dI, L_II
  double log_prior = 0;
};

struct Sizes {
  Eigen::Index inputs;
  Eigen::Index outputs;
  Eigen::Index of_line() const {
    return inputs + outputs + inputs * outputs + inputs * (inputs + 1) / 2 + 1;
  }
};

std::vector<Line> to_lines(const Gmm& gmm) {
  std::vector<Line> lines;
  const int num_inputs = gmm.input_dim();
  for (const Component& component : gmm.components()) {
    if (!(component.prior > 0)) throw FitError("a component without weight cannot be refined");
    const Eigen::MatrixXd factor = cholesky_factor(component.covariance);
    lines.push_back({component.mean.head(num_inputs), component.mean.tail(gmm.output_dim()),
                     factor.bottomLeftCorner(gmm.output_dim(), num_inputs),
                     factor.topLeftCorner(num_inputs, num_inputs),
                     elementary::log(component.prior)});
  }
  return lines;
}

/// The mixture of the lines, with what a regression does not know taken from `start`.
Gmm to_gmm(const std::vector<Line>& lines, const Gmm& start) {
  const int num_inputs = start.input_dim();
  double sum_before = 0;
  double sum = 0;
  double largest = lines[0].log_prior;
  for (const Line& line : lines) largest = std::max(largest, line.log_prior);
  for (const Component& component : start.components()) sum_before += component.prior;
  for (const Line& line : lines) sum += elementary::exp(line.log_prior - largest);
  std::vector<Component> components;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Component& before = start[static_cast<int>(k)];
    Eigen::MatrixXd factor = cholesky_factor(before.covariance);
    factor.topLeftCorner(num_inputs, num_inputs) = lines[k].factor;
    factor.bottomLeftCorner(start.output_dim(), num_inputs) = lines[k].psi;
    Component component;
    component.prior = sum_before * elementary::exp(lines[k].log_prior - largest) / sum;
    component.mean.resize(start.dim());
    component.mean << lines[k].mean_input, lines[k].mean_output;
    component.covariance = factor * factor.transpose();
    components.push_back(std::move(component));
  }
  return Gmm(num_inputs, std::move(components));
}

/// of lines and its derivative, sample by sample.
class Regression {
 public:
  explicit Regression(const std::vector<Line>& lines)
      : lines_(lines),
        sizes_{lines[0].mean_input.size(), lines[0].mean_output.size()},
        weights_(lines.size()) {
    for (const Line& line : lines) {
      const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(sizes_.inputs, sizes_.inputs);
      inverse_factors_.emplace_back(line.factor.triangularView<Eigen::Lower>().solve(unit));
      double constant = line.log_prior;
      for (Eigen::Index i = 0; i < sizes_.inputs; ++i) {
        constant -= elementary::log(line.factor(i, i));
      }
      constants_.push_back(constant);
      slopes_.emplace_back(line.psi * inverse_factors_.back());
      whitened_.emplace_back(sizes_.inputs);
      conditional_.emplace_back(sizes_.outputs);
    }
  }

  /// @param input  dI numbers
  const Eigen::VectorXd& at(const Eigen::Ref<const Eigen::VectorXd>& input) {
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      difference_ = input - lines_[k].mean_input;
      whitened_[k].noalias() = inverse_factors_[k] * difference_;
      conditional_[k] = lines_[k].mean_output;
      conditional_[k].noalias() += lines_[k].psi * whitened_[k];
      weights_[k] = constants_[k] - .5 * whitened_[k].squaredNorm();
      largest = std::max(largest, weights_[k]);
    }
    double sum = 0;
    for (double& weight : weights_) sum += (weight = elementary::exp(weight - largest));
    mean_.setZero(sizes_.outputs);
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      weights_[k] /= sum;
      mean_ += weights_[k] * conditional_[k];
    }
    return mean_;
  }

  /// d output / d element of every line, dO x (K of_line()), at the input of the last at().
  void derivative(Eigen::MatrixXd& into) {
    into.setZero(sizes_.outputs, static_cast<Eigen::Index>(lines_.size()) * sizes_.of_line());
    Eigen::Index column = 0;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      const double h = weights_[k];
      const Eigen::VectorXd& z = whitened_[k];
      const Eigen::MatrixXd& slope = slopes_[k];
      pull_.noalias() = inverse_factors_[k].transpose() * z;  // S_II^-1 (x - mu_I)
      beside_ = conditional_[k] - mean_;                      // d mean / d log h
      for (Eigen::Index i = 0; i < sizes_.inputs; ++i) {
        into.col(column++) = h * (pull_[i] * beside_ - slope.col(i));
      }
      for (Eigen::Index o = 0; o < sizes_.outputs; ++o) into(o, column++) = h;
      for (Eigen::Index o = 0; o < sizes_.outputs; ++o) {
        for (Eigen::Index i = 0; i < sizes_.inputs; ++i) into(o, column++) = h * z[i];
      }
      for (Eigen::Index i = 0; i < sizes_.inputs; ++i) {
        for (Eigen::Index j = 0; j <= i; ++j) {
          const double unit = i == j ? lines_[k].factor(i, i) : 1;  // by its logarithm
          const double log_weight = unit * pull_[i] * z[j] - (i == j ? 1 : 0);
          into.col(column++) = h * (log_weight * beside_ - unit * z[j] * slope.col(i));
        }
      }
      into.col(column++) = h * beside_;
    }
  }

 private:
  const std::vector<Line>& lines_;
  Sizes sizes_;
  std::vector<Eigen::MatrixXd> inverse_factors_;
  std::vector<Eigen::MatrixXd> slopes_;  // dO x dI
  std::vector<double> constants_;
  Eigen::VectorXd difference_, pull_, beside_;
  std::vector<Eigen::VectorXd> whitened_;
  std::vector<Eigen::VectorXd> conditional_;
  std::vector<double> weights_;
  Eigen::VectorXd mean_;
};

/// Bounds of the deviations, an input each.
struct Deviations {
  Eigen::VectorXd least;
  Eigen::VectorXd most;
};

Deviations deviations_of(const Eigen::MatrixXd& inputs) {
  const Eigen::VectorXd range = inputs.rowwise().maxCoeff() - inputs.rowwise().minCoeff();
  return {kDeviationMin * range, kDeviationMax * range};
}

/// The problem: data and the units of the outputs.
class Problem {
 public:
  Problem(const Eigen::MatrixXd& data, Eigen::Index num_inputs)
      : inputs_(data.topRows(num_inputs)),
        outputs_(data.bottomRows(data.rows() - num_inputs)),
        unit_(output_units(outputs_)),
        deviations_(deviations_of(inputs_)),
        share_(1 / (1 - outputs_.array().isNaN().cast<double>()).sum()) {}

  /// Mean over samples and outputs of the squared relative error.
  double cost(const std::vector<Line>& lines) const {
    Regression regression(lines);
    Eigen::VectorXd r;
    double sum = 0;
    for (Eigen::Index n = 0; n < inputs_.cols(); ++n) {
      residual(regression, n, r);
      sum += r.squaredNorm();
    }
    return sum * share_;
  }

  std::vector<Line> stepped(std::vector<Line> lines, const Eigen::VectorXd& step) const {
    Eigen::Index at = 0;
    for (Line& line : lines) {
      for (double& number : line.mean_input) number += step[at++];
      for (double& number : line.mean_output) number += step[at++];
      for (Eigen::Index o = 0; o < line.psi.rows(); ++o) {
        for (Eigen::Index i = 0; i < line.psi.cols(); ++i) line.psi(o, i) += step[at++];
      }
      for (Eigen::Index i = 0; i < line.factor.rows(); ++i) {
        for (Eigen::Index j = 0; j < i; ++j) line.factor(i, j) += step[at++];
        line.factor(i, i) =
            std::clamp(line.factor(i, i) * elementary::exp(std::min(step[at++], 50.)),
                       deviations_.least[i], deviations_.most[i]);
      }
      line.log_prior += step[at++];
    }
    return lines;
  }

  /// Sums are written out, sample by sample: the same bits on every machine.
  Normal normal(const std::vector<Line>& lines) const {
    Regression regression(lines);
    const Eigen::Index size =
        static_cast<Eigen::Index>(lines.size()) * Sizes{inputs_.rows(), outputs_.rows()}.of_line();
    Normal result{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    Eigen::MatrixXd derivative;
    Eigen::VectorXd r;
    Eigen::VectorXd row;
    for (Eigen::Index n = 0; n < inputs_.cols(); ++n) {
      residual(regression, n, r);
      regression.derivative(derivative);
      for (Eigen::Index o = 0; o < r.size(); ++o) {
        if (std::isnan(outputs_(o, n))) continue;
        row = derivative.row(o).transpose() / unit_[o];
        result.gradient += r[o] * row;
        add_square(row, result.squares);
      }
    }
    result.gradient *= share_;
    result.squares = (share_ * result.squares).selfadjointView<Eigen::Lower>();
    return result;
  }

 private:
  void residual(Regression& regression, Eigen::Index n, Eigen::VectorXd& into) const {
    into = (regression.at(inputs_.col(n)) - outputs_.col(n)).cwiseQuotient(unit_);
    // An output that a sample lacks has no error. Any other that is no number stays one: no step
    // that leads there is taken.
    for (Eigen::Index o = 0; o < into.size(); ++o) {
      if (std::isnan(outputs_(o, n))) into[o] = 0;
    }
  }

  Eigen::MatrixXd inputs_;
  Eigen::MatrixXd outputs_;
  Eigen::VectorXd unit_;
  Deviations deviations_;
  double share_;
};

}  // namespace

Gmm refine_regression(const Gmm& start, const Eigen::MatrixXd& data,
                      const RegressionSettings& settings) {
  CHECK(data.rows() == start.dim() && data.cols() > 0, "data are d x N, N > 0");
  const Problem problem(data, start.input_dim());
  return to_gmm(minimised(problem, to_lines(start), settings).point, start);
}

double relative_regression_error(const Gmm& gmm, const Eigen::MatrixXd& data) {
  return std::sqrt(Problem(data, gmm.input_dim()).cost(to_lines(gmm)));
}

}  // namespace treeroll
