#include "learner/figures/policy_plot.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/policy/gmr.h"

namespace treeroll {
namespace {

constexpr std::size_t kPanelsMax = 12;
constexpr int kEllipsePoints = 48;
constexpr int kCurvePoints = 200;
constexpr double kDeviations = 2;

/// The data sets of a plot, counted as gnuplot does.
struct DataSets {
  std::string text = {};
  int count = 0;

  void begin(const std::string& columns) { text += "# " + columns + "\n"; }
  void add(double x, double y) { text += fmt::format("{} {}\n", datum(x), datum(y)); }
  int end() {
    text += "\n\n";
    return count++;
  }
};

/// Ellipses of a layer in the plane of the input and the first output, an empty line between them.
int add_ellipses(const Gmm& layer, DataSets& data) {
  data.begin("input output: ellipses");
  for (const Component& component : layer.components()) {
    Eigen::Matrix2d covariance;
    const Eigen::Index output = layer.input_dim();
    covariance << component.covariance(0, 0), component.covariance(0, output),
        component.covariance(output, 0), component.covariance(output, output);
    const Eigen::Matrix2d factor = covariance.llt().matrixL();
    for (int i = 0; i <= kEllipsePoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kEllipsePoints;
      const Eigen::Vector2d at =
          kDeviations * factor * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      data.add(component.mean[0] + at[0], component.mean[output] + at[1]);
    }
    data.text += "\n";
  }
  return data.end();
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

/// The inputs that the Gaussians cover.
Range inputs_of(const Gmm& gmm) {
  Range range;
  for (const Component& component : gmm.components()) {
    const double reach = kDeviations * std::sqrt(component.covariance(0, 0));
    range.low = std::min(range.low, component.mean[0] - reach);
    range.high = std::max(range.high, component.mean[0] + reach);
  }
  return range;
}

int add_regression(const Gmm& gmm, Range range, DataSets& data) {
  data.begin("input output: regression");
  const Gmr gmr(gmm);
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double input = range.low + (range.high - range.low) * i / kCurvePoints;
    data.add(input, gmr.regress(Eigen::VectorXd::Constant(1, input))[0]);
  }
  return data.end();
}

}  // namespace

Plot policy_plot(const std::string& study, const std::vector<LearntPolicy>& policies) {
  Plot plot{.id = "policies", .title = "Policies of " + study + " before and after learning"};
  PanelGrid grid{.commands = {}, .labels = {"regression", "start"}, .panel_height_px = 320};
  int num_layers = 0;
  DataSets data;
  for (const LearntPolicy& policy : policies) {
    if (policy.start.input_dim() != 1) return {};
    if (grid.commands.size() == kPanelsMax) break;
    const TreeModel& after = policy.best ? policy.best->tree : policy.start;
    num_layers = std::max(num_layers, after.num_layers());
    const Gmm start = policy.start.finest();
    const Range range = inputs_of(start);
    std::string lines = fmt::format("data index {} using 1:2 with lines lt 2 lw 1 notitle, ",
                                    add_ellipses(start, data));
    lines += fmt::format("data index {} using 1:2 with lines lt 2 notitle",
                         add_regression(start, range, data));
    for (int layer = 1; layer <= after.num_layers(); ++layer) {
      lines += fmt::format(", data index {} using 1:2 with lines lt {} lw 1 notitle",
                           add_ellipses(after.layer(layer), data), std::min(layer, 3) + 2);
    }
    lines += fmt::format(", data index {} using 1:2 with lines lt 1 notitle",
                         add_regression(after.finest(), range, data));
    grid.commands.push_back(
        fmt::format("  set title {}\n  set xlabel 'input'; set ylabel 'output'\n  unset key\n"
                    "  set xrange [{}:{}]; set yrange [*:*]\n  plot {}\n",
                    literal(policy.condition), range.low, range.high, lines));
  }
  if (grid.commands.empty()) return {};
  for (int layer = 1; layer <= std::min(num_layers, 2); ++layer) {
    grid.labels.push_back(fmt::format("layer {}", layer));
  }
  if (num_layers > 2) grid.labels.emplace_back("further layers");
  plot.data = std::move(data.text);
  arrange(grid, plot);
  plot.commands.insert(0, "  set linetype 2 lc rgb '#888888' lw 2 dt (6,4)\n");
  plot.caption = fmt::format(
      "Output over input of the best roll-out of all repetitions, with the Gaussians of each layer "
      "(ellipses of two standard deviations); in grey what learning began with.{}{}",
      policies.front().start.dim() > 2 ? " The first of several outputs." : "",
      policies.size() > kPanelsMax
          ? fmt::format(" The first {} of {} conditions.", kPanelsMax, policies.size())
          : "");
  return plot;
}

}  // namespace treeroll
