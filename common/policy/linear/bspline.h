#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/policy/linear/basis.h"

namespace treeroll {

/// B-splines of one degree over [low, high]: as many functions as coefficients, each the sum of
/// which is a curve. Clamped: the first and last coefficient are the values at the ends, and beyond
/// them the curve stays. Inner knots are equally spaced.
class BSpline final : public Basis {
 public:
  static constexpr int kDegreeMax = 7;

  /// Precondition: degree is from 0 to kDegreeMax, size at least degree + 1, low < high.
  BSpline(int degree, int size, double low, double high);

  int degree() const { return degree_; }
  int size() const override { return static_cast<int>(knots_.size()) - degree_ - 1; }
  int num_spans() const { return size() - degree_; }
  double low() const override { return knots_.front(); }
  double high() const override { return knots_.back(); }
  int num_at_once() const override { return degree_ + 1; }
  const std::vector<double>& knots() const { return knots_; }

  /// Cox and de Boor. The sum is 1.
  int values(double input, std::span<double> values) const override;

  /// The same curves with a knot more in the middle of each span: 2 num_spans() spans.
  BSpline refined() const;
  /// Its size.
  static int refined_size(int degree, int size) { return 2 * (size - degree) + degree; }
  /// Coefficients of refined() from those of this: refined().size() x size(), by inserting knot
  /// after knot (Boehm). The curve stays as it is.
  Eigen::MatrixXd insertion() const;

 private:
  BSpline(int degree, std::vector<double> knots) : degree_(degree), knots_(std::move(knots)) {}
  /// The k with knots[k] <= input < knots[k + 1]; the last span holds its end.
  int span_of(double input) const;

  int degree_;
  std::vector<double> knots_;
};

}  // namespace treeroll
