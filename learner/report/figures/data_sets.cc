#include "learner/report/figures/data_sets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <span>

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

std::string ellipses(const PolicySketch::Layer& layer, Plane plane, const std::string& style,
                     DataSets& data) {
  if (layer.gaussians.empty()) return "";
  data.begin("across up: ellipses");
  for (const PolicySketch::Gaussian& gaussian : layer.gaussians) {
    const Eigen::MatrixXd& s = gaussian.covariance;
    Eigen::Matrix2d covariance;
    covariance << s(plane.across, plane.across), s(plane.across, plane.up),
        s(plane.up, plane.across), s(plane.up, plane.up);
    const Eigen::Matrix2d factor = covariance.llt().matrixL();
    for (int i = 0; i <= kEllipsePoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kEllipsePoints;
      const Eigen::Vector2d at =
          kEllipseDeviations * factor * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      data.add(gaussian.mean[plane.across] + at[0], gaussian.mean[plane.up] + at[1]);
    }
    data.interrupt();
  }
  return fmt::format("data index {} using 1:2 with lines {} notitle, ", data.end(), style);
}

std::string curve(const PolicySketch::Layer& layer, Plane plane, Range inputs,
                  const std::string& style, DataSets& data) {
  data.begin("across up: regression");
  Controller& controller = *layer.controller;
  controller.start();
  std::vector<double> all(1 + static_cast<std::size_t>(controller.output_dim()));
  for (int i = 0; i <= kCurvePoints; ++i) {
    all[0] = inputs.low + (inputs.high - inputs.low) * i / kCurvePoints;
    controller.act(std::span(all).first(1), std::span(all).subspan(1));
    data.add(all[static_cast<std::size_t>(plane.across)], all[static_cast<std::size_t>(plane.up)]);
  }
  return fmt::format("data index {} using 1:2 with lines {} notitle", data.end(), style);
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
