#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common/policy/policy.h"
#include "learner/report/figures/plot.h"

namespace treeroll::report {

using Range = PolicySketch::Range;

/// What covers all points given so far.
struct Box {
  Range across{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Range up = across;

  void include(double x, double y);
};

/// The data of a plot, set after set as gnuplot counts them.
class DataSets {
 public:
  void begin(const std::string& what) { text_ += "# " + what + "\n"; }
  void add(double x, double y);
  /// A line ends; the set goes on.
  void interrupt() { text_ += "\n"; }
  /// @return the index of the set that ends here
  int end();
  std::string take() { return std::move(text_); }
  /// Of all points that are finite, since the last call of begin_box().
  const Box& box() const { return box_; }
  void begin_box() { box_ = {}; }

 private:
  std::string text_;
  int count_ = 0;
  Box box_;
};

/// How far from its mean a Gaussian is drawn, in standard deviations.
inline constexpr double kEllipseDeviations = 2;

/// What is drawn over what: two variables of [input; output].
struct Plane {
  Eigen::Index across = 0;
  Eigen::Index up = 1;
};

/// Whether any of its layers has Gaussians to draw: what is not there is neither named nor
/// described.
bool has_gaussians(const PolicySketch& sketch);

/// Each Gaussian's ellipse of two standard deviations in the plane.
/// @param style  of the lines, as gnuplot has it
/// @return       their part of a plot command, ending in ", "; empty for a layer without Gaussians
std::string ellipses(const PolicySketch::Layer& layer, Plane plane, const std::string& style,
                     DataSets& data);

/// What the layer's controller gives, as a curve in the plane over a range of the input.
/// Precondition: one input.
/// @return  its part of a plot command
std::string curve(const PolicySketch::Layer& layer, Plane plane, Range inputs,
                  const std::string& style, DataSets& data);

/// A line through points. Precondition: `across` is as long as `up`.
int add_curve(const std::string& what, const std::vector<double>& across,
              const std::vector<double>& up, DataSets& data);

/// The same of several layers, as one data set; over the input the curves are coarser.
std::string curves(const std::vector<PolicySketch::Layer>& layers, Plane plane, Range inputs,
                   const std::string& style, DataSets& data);

/// The range of an axis for gnuplot: chosen by it, but for a line that stays where it is, of which
/// gnuplot would warn.
std::string axis_range(const Range& drawn);

/// Ranges and marks of axes of one scale, for panels that show one variable over another of the
/// same kind: `set xrange ..`, as a line.
std::string equal_axes(const Box& box);

/// `set xlabel X; set ylabel Y`, as a line.
std::string axis_labels(const std::string& across, const std::string& up);

}  // namespace treeroll::report
