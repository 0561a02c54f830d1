#include "learner/fit/missing_outputs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

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
  Rows missing = others(there, component.mean.size());
  const Eigen::MatrixXd across = component.covariance(missing, there);
  const Eigen::MatrixXd factor = cholesky_factor(component.covariance(there, there));
  Eigen::MatrixXd gains = factor.triangularView<Eigen::Lower>().solve(across.transpose());
  factor.triangularView<Eigen::Lower>().transpose().solveInPlace(gains);
  gains.transposeInPlace();
  Eigen::MatrixXd left = component.covariance(missing, missing) - gains * across.transpose();
  return {there, std::move(missing), std::move(gains), std::move(left)};
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
  return {component.prior, component.mean(rows), component.covariance(rows, rows)};
}

Eigen::VectorXd variances(const Eigen::MatrixXd& data) {
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(data.rows());
  for (Eigen::Index i = 0; i < data.rows(); ++i) {
    std::vector<double> row;
    for (Eigen::Index n = 0; n < data.cols(); ++n) {
      if (!std::isnan(data(i, n))) row.push_back(data(i, n));
    }
    const auto [low, high] = std::minmax_element(row.begin(), row.end());
    if (row.empty() || *low == *high) continue;
    const auto count = static_cast<double>(row.size());
    double mean = 0;
    for (const double number : row) mean += number / count;
    for (const double number : row) variance[i] += (number - mean) * (number - mean) / count;
  }
  return variance;
}

Completed completed(const Component& component, const Eigen::MatrixXd& data,
                    const Eigen::VectorXd& weight) {
  Conditionals conditionals(component);
  Completed result{data, Eigen::MatrixXd::Zero(data.rows(), data.rows())};
  double weight_sum = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    weight_sum += weight[n];
    const Rows there = rows_of(data.col(n));
    if (static_cast<Eigen::Index>(there.size()) == data.rows()) continue;
    const Conditional& from = conditionals.of(there);
    for (std::size_t m = 0; m < from.missing.size(); ++m) {
      const auto of_m = static_cast<Eigen::Index>(m);
      double value = component.mean[from.missing[m]];
      for (std::size_t o = 0; o < there.size(); ++o) {
        value += from.gains(of_m, static_cast<Eigen::Index>(o)) *
                 (data(there[o], n) - component.mean[there[o]]);
      }
      result.data(from.missing[m], n) = value;
      for (std::size_t k = 0; k < from.missing.size(); ++k) {
        result.left(from.missing[m], from.missing[k]) +=
            weight[n] * from.left(of_m, static_cast<Eigen::Index>(k));
      }
    }
  }
  result.left /= weight_sum;
  return result;
}

}  // namespace treeroll
