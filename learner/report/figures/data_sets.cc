#include "learner/report/figures/data_sets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace treeroll::report {
namespace {

constexpr int kEllipsePoints = 48;
constexpr int kCurvePoints = 200;
constexpr int kCurvePointsOfMany = 80;  // over the input; a path may go round and round

void add_points(const PolicySketch::Layer& layer, Plane plane, Range inputs, int num_steps,
                DataSets& data) {
  Controller& controller = *layer.controller;
  controller.start();
  std::vector<double> all(1 + static_cast<std::size_t>(controller.output_dim()));
  for (int i = 0; i <= num_steps; ++i) {
    all[0] = inputs.low + (inputs.high - inputs.low) * i / num_steps;
    controller.act(std::span(all).first(1), std::span(all).subspan(1));
    data.add(all[static_cast<std::size_t>(plane.across)], all[static_cast<std::size_t>(plane.up)]);
  }
}

}  // namespace

void Box::include(double x, double y) {
  if (!std::isfinite(x) || !std::isfinite(y)) return;
  across = {std::min(across.low, x), std::max(across.high, x)};
  up = {std::min(up.low, y), std::max(up.high, y)};
}

void DataSets::add(double x, double y) {
  text_ += fmt::format("{} {}\n", datum(x), datum(y));
  box_.include(x, y);
}

int DataSets::end() {
  text_ += "\n\n";
  return count_++;
}

bool has_gaussians(const PolicySketch& sketch) {
  return std::ranges::any_of(
      sketch.layers, [](const PolicySketch::Layer& layer) { return !layer.gaussians.empty(); });
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
  add_points(layer, plane, inputs, kCurvePoints, data);
  return fmt::format("data index {} using 1:2 with lines {} notitle", data.end(), style);
}

std::string curves(const std::vector<PolicySketch::Layer>& layers, Plane plane, Range inputs,
                   const std::string& style, DataSets& data) {
  data.begin("across up: regressions");
  for (const PolicySketch::Layer& layer : layers) {
    add_points(layer, plane, inputs, plane.across == 0 ? kCurvePointsOfMany : kCurvePoints, data);
    data.interrupt();
  }
  return fmt::format("data index {} using 1:2 with lines {} notitle", data.end(), style);
}

int add_curve(const std::string& what, const std::vector<double>& across,
              const std::vector<double>& up, DataSets& data) {
  data.begin("across up: " + what);
  for (std::size_t i = 0; i < up.size(); ++i) data.add(across[i], up[i]);
  return data.end();
}

std::string axis_range(const Range& drawn) {
  if (!(drawn.low <= drawn.high)) return "[*:*]";  // no point at all
  // Sums of equal numbers differ in their last bits.
  const double size = std::max(std::abs(drawn.low), std::abs(drawn.high));
  if (!(drawn.high - drawn.low <= 1e-9 * size)) return "[*:*]";
  const double margin = std::max(1., 1e-3 * size);  // which six digits show
  return fmt::format("[{:.6g}:{:.6g}]", drawn.low - margin, drawn.high + margin);
}

std::string equal_axes(const Box& box) {
  constexpr double kMargin = .04;
  constexpr double kLeastSpan = 1e-9;
  const auto span = [](const Range& range) { return range.high - range.low; };
  const double larger = std::max(span(box.across), span(box.up));
  if (!(larger >= 0)) return "  set size ratio -1\n";  // no point at all
  const double margin = kMargin * std::max(larger, kLeastSpan);
  return fmt::format(
      "  set size ratio -1; set xrange [{0:.6g}:{1:.6g}]; set yrange [{2:.6g}:{3:.6g}]\n"
      "  set xtics {4}; set ytics {4}\n",
      box.across.low - margin, box.across.high + margin, box.up.low - margin, box.up.high + margin,
      round_step(larger + 2 * margin));
}

std::string axis_labels(const std::string& across, const std::string& up) {
  return fmt::format("  set xlabel {}; set ylabel {}\n", literal(across), literal(up));
}

}  // namespace treeroll::report
