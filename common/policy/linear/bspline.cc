#include "common/policy/linear/bspline.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/base/check.h"

namespace treeroll {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

BSpline::BSpline(int degree, int size, double low, double high) : degree_(degree) {
  CHECK(0 <= degree && degree <= kDegreeMax && size > degree && low < high, "no such splines");
  const int spans = size - degree;
  knots_.assign(at(degree + 1), low);
  for (int i = 1; i < spans; ++i) knots_.push_back(low + (high - low) * i / spans);
  knots_.insert(knots_.end(), at(degree + 1), high);
}

int BSpline::span_of(double input) const {
  const auto inner_end = knots_.end() - degree_ - 1;
  const auto after = std::upper_bound(knots_.begin() + degree_ + 1, inner_end, input);
  return static_cast<int>(after - knots_.begin()) - 1;
}

int BSpline::values(double input, std::span<double> values) const {
  const double x = std::clamp(input, low(), high());
  const int span = span_of(x);
  std::array<double, kDegreeMax + 1> left{};
  std::array<double, kDegreeMax + 1> right{};
  values[0] = 1;
  for (int r = 1; r <= degree_; ++r) {
    left[at(r)] = x - knots_[at(span + 1 - r)];
    right[at(r)] = knots_[at(span + r)] - x;
    double carried = 0;
    for (int i = 0; i < r; ++i) {
      const double share = values[at(i)] / (right[at(i + 1)] + left[at(r - i)]);
      values[at(i)] = carried + right[at(i + 1)] * share;
      carried = left[at(r - i)] * share;
    }
    values[at(r)] = carried;
  }
  return span - degree_;
}

BSpline BSpline::refined() const { return {degree_, refined_size(degree_, size()), low(), high()}; }

Eigen::MatrixXd BSpline::insertion() const {
  std::vector<double> knots = knots_;
  Eigen::MatrixXd from_old = Eigen::MatrixXd::Identity(size(), size());
  const std::vector<double> wanted = refined().knots_;
  for (int i = 0; i < num_spans(); ++i) {
    // Every second inner knot of the refined splines is new.
    const double knot = wanted[at(degree_ + 1 + 2 * i)];
    const BSpline now(degree_, knots);
    const int span = now.span_of(knot);
    Eigen::MatrixXd next(from_old.rows() + 1, from_old.cols());
    for (int j = 0; j < next.rows(); ++j) {
      // c'_j = a c_j + (1 - a) c_{j-1}
      const double a = j <= span - degree_ ? 1
                       : j > span          ? 0
                                  : (knot - knots[at(j)]) / (knots[at(j + degree_)] - knots[at(j)]);
      next.row(j) = a == 1 ? Eigen::RowVectorXd(from_old.row(j))
                    : a == 0
                        ? Eigen::RowVectorXd(from_old.row(j - 1))
                        : Eigen::RowVectorXd(a * from_old.row(j) + (1 - a) * from_old.row(j - 1));
    }
    from_old = std::move(next);
    knots.insert(knots.begin() + span + 1, knot);
  }
  return from_old;
}

}  // namespace treeroll
