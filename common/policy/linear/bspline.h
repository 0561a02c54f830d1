#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace treeroll {

/// B-splines of one degree over [low, high]: as many functions as coefficients, each the sum of
/// which is a curve. Clamped: the first and last coefficient are the values at the ends, and beyond
/// them the curve stays. Inner knots are equally spaced.
class BSpline {
 public:
  static constexpr int kDegreeMax = 7;

  /// Precondition: degree is from 0 to kDegreeMax, size at least degree + 1, low < high.
  BSpline(int degree, int size, double low, double high);

  int degree() const { return degree_; }
  int size() const { return static_cast<int>(knots_.size()) - degree_ - 1; }
  int num_spans() const { return size() - degree_; }
  double low() const { return knots_.front(); }
  double high() const { return knots_.back(); }
  const std::vector<double>& knots() const { return knots_; }

  /// Cox and de Boor: the functions that are not 0 at an input, all others are.
  /// @param values  degree + 1 numbers, sum 1
  /// @return        index of the first of them
  int values(double input, std::span<double> values) const;
  /// All functions at several inputs: inputs x size().
  Eigen::MatrixXd matrix(std::span<const double> inputs) const;

  /// The same curves with a knot more in the middle of each span: 2 num_spans() spans.
  BSpline refined() const;
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
