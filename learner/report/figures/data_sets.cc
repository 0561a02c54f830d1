#include "learner/report/figures/data_sets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/policy/gmr.h"

namespace treeroll::report {
namespace {

constexpr int kEllipsePoints = 48;
constexpr int kCurvePoints = 200;

}  // namespace

void DataSets::add(double x, double y) { text_ += fmt::format("{} {}\n", datum(x), datum(y)); }

int DataSets::end() {
  text_ += "\n\n";
  return count_++;
}

int add_ellipses(const Gmm& gmm, Plane plane, DataSets& data) {
  data.begin("across up: ellipses");
  for (const Component& component : gmm.components()) {
    Eigen::Matrix2d covariance;
    covariance << component.covariance(plane.across, plane.across),
        component.covariance(plane.across, plane.up), component.covariance(plane.up, plane.across),
        component.covariance(plane.up, plane.up);
    const Eigen::Matrix2d factor = covariance.llt().matrixL();
    for (int i = 0; i <= kEllipsePoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kEllipsePoints;
      const Eigen::Vector2d at =
          kEllipseDeviations * factor * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      data.add(component.mean[plane.across] + at[0], component.mean[plane.up] + at[1]);
    }
    data.interrupt();
  }
  return data.end();
}

Range inputs_of(const Gmm& gmm) {
  Range range{.low = std::numeric_limits<double>::infinity(),
              .high = -std::numeric_limits<double>::infinity()};
  for (const Component& component : gmm.components()) {
    const double reach = kEllipseDeviations * std::sqrt(component.covariance(0, 0));
    range.low = std::min(range.low, component.mean[0] - reach);
    range.high = std::max(range.high, component.mean[0] + reach);
  }
  return range;
}

int add_regression(const Gmm& gmm, Plane plane, Range inputs, DataSets& data) {
  data.begin("across up: regression");
  const Gmr gmr(gmm);
  for (int i = 0; i <= kCurvePoints; ++i) {
    Eigen::VectorXd all(gmm.dim());
    all[0] = inputs.low + (inputs.high - inputs.low) * i / kCurvePoints;
    all.tail(gmm.output_dim()) = gmr.regress(Eigen::VectorXd::Constant(1, all[0]));
    data.add(all[plane.across], all[plane.up]);
  }
  return data.end();
}

int add_curve(const std::string& what, const std::vector<double>& across,
              const std::vector<double>& up, DataSets& data) {
  data.begin("across up: " + what);
  for (std::size_t i = 0; i < up.size(); ++i) data.add(across[i], up[i]);
  return data.end();
}

std::string axis_labels(const std::string& across, const std::string& up) {
  return fmt::format("  set xlabel {}; set ylabel {}\n", literal(across), literal(up));
}

}  // namespace treeroll::report
