#include "learner/fit/missing_outputs.h"

#include <cmath>
#include <map>

#include "common/policy/tree/frame.h"

namespace treeroll {
namespace {

using Rows = std::vector<Eigen::Index>;

Rows others(const Rows& rows, Eigen::Index dim) {
  Rows missing;
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < dim; ++i) {
    if (next < rows.size() && rows[next] == i) {
      ++next;
    } else {
      missing.push_back(i);
    }
  }
  return missing;
}

/// How the rows that are missing follow from those that are there, for one pattern of them.
struct Conditional {
  Rows there, missing;
  Eigen::MatrixXd gains;  ///< missing x there: S_MO S_OO^-1
  Eigen::MatrixXd left;   ///< missing x missing: S_MM - S_MO S_OO^-1 S_OM
};

Conditional conditional(const Component& component, const Rows& there) {
  Conditional result{
      .there = there, .missing = others(there, component.mean.size()), .gains = {}, .left = {}};
  const Eigen::MatrixXd factor = cholesky_factor(marginal(component, there).covariance);
  const auto num_there = static_cast<Eigen::Index>(there.size());
  const auto num_missing = static_cast<Eigen::Index>(result.missing.size());
  result.gains.resize(num_missing, num_there);
  result.left.resize(num_missing, num_missing);
  for (Eigen::Index m = 0; m < num_missing; ++m) {
    Eigen::VectorXd row(num_there);
    for (Eigen::Index o = 0; o < num_there; ++o) {
      row[o] = component.covariance(result.missing[static_cast<std::size_t>(m)],
                                    there[static_cast<std::size_t>(o)]);
    }
    factor.triangularView<Eigen::Lower>().solveInPlace(row);
    factor.triangularView<Eigen::Lower>().transpose().solveInPlace(row);
    result.gains.row(m) = row.transpose();
  }
  for (Eigen::Index m = 0; m < num_missing; ++m) {
    for (Eigen::Index k = 0; k < num_missing; ++k) {
      const Eigen::Index of_m = result.missing[static_cast<std::size_t>(m)];
      const Eigen::Index of_k = result.missing[static_cast<std::size_t>(k)];
      double left = component.covariance(of_m, of_k);
      for (Eigen::Index o = 0; o < num_there; ++o) {
        left -= result.gains(m, o) * component.covariance(there[static_cast<std::size_t>(o)], of_k);
      }
      result.left(m, k) = left;
    }
  }
  return result;
}

/// Samples mostly lack the same outputs: one conditional for each pattern.
class Conditionals {
 public:
  explicit Conditionals(const Component& component) : component_(component) {}
  const Conditional& of(const Rows& there) {
    const auto found = by_rows_.find(there);
    if (found != by_rows_.end()) return found->second;
    return by_rows_.emplace(there, conditional(component_, there)).first->second;
  }

 private:
  const Component& component_;
  std::map<Rows, Conditional> by_rows_;
};

}  // namespace

bool is_complete(const Eigen::MatrixXd& data) { return !data.hasNaN(); }

Rows rows_of(const Eigen::VectorXd& sample) {
  Rows rows;
  for (Eigen::Index i = 0; i < sample.size(); ++i) {
    if (!std::isnan(sample[i])) rows.push_back(i);
  }
  return rows;
}

Component marginal(const Component& component, const Rows& rows) {
  const auto dim = static_cast<Eigen::Index>(rows.size());
  Component result{.prior = component.prior,
                   .mean = Eigen::VectorXd(dim),
                   .covariance = Eigen::MatrixXd(dim, dim)};
  for (Eigen::Index i = 0; i < dim; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    result.mean[i] = component.mean[row];
    for (Eigen::Index j = 0; j < dim; ++j) {
      result.covariance(i, j) = component.covariance(row, rows[static_cast<std::size_t>(j)]);
    }
  }
  return result;
}

Eigen::MatrixXd expected(const Component& component, const Eigen::MatrixXd& data) {
  Conditionals conditionals(component);
  Eigen::MatrixXd filled = data;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    const Rows there = rows_of(data.col(n));
    if (static_cast<Eigen::Index>(there.size()) == data.rows()) continue;
    const Conditional& from = conditionals.of(there);
    for (std::size_t m = 0; m < from.missing.size(); ++m) {
      double value = component.mean[from.missing[m]];
      for (std::size_t o = 0; o < there.size(); ++o) {
        value += from.gains(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(o)) *
                 (data(there[o], n) - component.mean[there[o]]);
      }
      filled(from.missing[m], n) = value;
    }
  }
  return filled;
}

Eigen::MatrixXd covariance_left(const Component& component, const Eigen::MatrixXd& data,
                                const Eigen::VectorXd& weight) {
  Conditionals conditionals(component);
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(data.rows(), data.rows());
  double weight_sum = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    weight_sum += weight[n];
    const Rows there = rows_of(data.col(n));
    if (static_cast<Eigen::Index>(there.size()) == data.rows()) continue;
    const Conditional& from = conditionals.of(there);
    for (std::size_t m = 0; m < from.missing.size(); ++m) {
      for (std::size_t k = 0; k < from.missing.size(); ++k) {
        left(from.missing[m], from.missing[k]) +=
            weight[n] * from.left(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
      }
    }
  }
  return left / weight_sum;
}

}  // namespace treeroll
