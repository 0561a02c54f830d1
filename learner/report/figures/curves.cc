#include "learner/report/figures/curves.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "learner/results/statistics.h"

namespace treeroll::report {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// More points than these a line does not show.
constexpr std::size_t kPointsMax = 200;

struct Point {
  double rollout = 0;  ///< from 1
  double mean = kNone;
  double low = kNone;
  double high = kNone;
};

std::size_t longest(const Curve& curve) {
  std::size_t length = 0;
  for (const auto& values : curve.repetitions) length = std::max(length, values.size());
  return length;
}

/// Over repetitions, each with its mean over `width` roll-outs from `first` on.
Point point(const Curve& curve, std::size_t first, std::size_t width, bool is_logarithmic) {
  std::vector<double> values;
  for (const auto& repetition : curve.repetitions) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = first; i < std::min(first + width, repetition.size()); ++i) {
      if (std::isnan(repetition[i])) continue;
      sum += is_logarithmic ? std::log(repetition[i]) : repetition[i];
      ++count;
    }
    if (count > 0) values.push_back(sum / count);
  }
  const auto shown = [&](double value) { return is_logarithmic ? std::exp(value) : value; };
  Point found{.rollout = static_cast<double>(first) + 1 + static_cast<double>(width - 1) / 2};
  if (!values.empty()) found.mean = shown(*mean(values));
  if (const auto interval = mean_interval_95(values)) {
    found.low = shown(interval->low);
    found.high = shown(interval->high);
  }
  return found;
}

/// Where a logarithmic axis has numbers: at 1, 2, 5 of each decade, or at its powers of ten alone.
std::string logarithmic_tics(double low, double high) {
  constexpr std::size_t kTicsMax = 7;
  std::vector<std::string> few;
  std::vector<std::string> many;
  for (double decade = std::floor(std::log10(low)); decade <= std::log10(high); ++decade) {
    for (const int digit : {1, 2, 5}) {
      const double at = digit * std::pow(10., decade);
      if (at < low || at > high) continue;
      many.push_back(fmt::format("{:g}", at));
      if (digit == 1) few.push_back(many.back());
    }
  }
  const bool has_room = many.size() <= kTicsMax || few.size() < 2;
  return fmt::format("set ytics ({})", fmt::join(has_room ? many : few, ", "));
}

/// The reach of all that is drawn.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(const Point& p) {
    for (const double value : {p.mean, p.low, p.high}) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  std::string range(bool is_logarithmic) const {
    constexpr double kMargin = 1.2;
    if (is_logarithmic && low <= high) {
      return fmt::format("[{}:{}]; set logscale y; {}", low / kMargin, high * kMargin,
                         logarithmic_tics(low / kMargin, high * kMargin));
    }
    // One value, or none.
    const double from = low < high ? low : std::isfinite(low) ? low - .5 : 0;
    const double to = low < high ? high : from + 1;
    const double margin = .03 * (to - from);
    return fmt::format("[{}:{}]", from - margin, to + margin);
  }
};

std::string datum_line(const Point& p) {
  return fmt::format("{} {} {} {}\n", p.rollout, datum(p.mean), datum(p.low), datum(p.high));
}

/// Adds a curve's data, and its marks' where it has some, to the plot.
/// @return  what draws it: band, line, marks
struct Drawn {
  std::string band;
  std::string line;
};
Drawn add_curve(const Curve& curve, std::size_t type, std::size_t width, bool is_logarithmic,
                std::size_t& index, Extent& extent, Plot& plot) {
  plot.data += "# rollout mean low high\n";
  const std::size_t length = std::max<std::size_t>(longest(curve), 1);
  for (std::size_t first = 0; first < length; first += width) {
    const Point p = point(curve, first, width, is_logarithmic);
    plot.data += datum_line(p);
    extent.include(p);
  }
  plot.data += "\n\n";
  Drawn drawn{.band = fmt::format("data index {} using 1:3:4 with filledcurves lt {} fs "
                                  "transparent solid .15 notitle, ",
                                  index, type),
              .line = fmt::format("data index {} using 1:2 with lines lt {} title {}", index, type,
                                  literal(curve.label))};
  ++index;
  if (curve.switches.empty()) return drawn;
  plot.data += "# rollout mean low high: switches\n";
  for (const double rollout : curve.switches) {
    const auto first = static_cast<std::size_t>(std::max(rollout, 1.) - 1) / width * width;
    plot.data += datum_line(point(curve, first, width, is_logarithmic));
  }
  plot.data += "\n\n";
  drawn.line += fmt::format(
      ", data index {} using 1:2 with points pt 6 ps 1.2 lw 2 lc rgb '#000000' notitle", index);
  ++index;
  return drawn;
}

}  // namespace

std::size_t draw_curves(const Rows<CurvePanel>& rows, const CurveAxis& axis, Plot& plot) {
  std::vector<const CurvePanel*> panels;
  std::size_t length = 1;
  for (const auto& row : rows) {
    for (const CurvePanel& panel : row) {
      panels.push_back(&panel);
      for (const Curve& curve : panel.curves) length = std::max(length, longest(curve));
    }
  }
  const std::size_t width = (length + kPointsMax - 1) / kPointsMax;

  Extent extent;
  std::vector<std::string> curves;  // by panel
  std::vector<std::vector<std::string>> labels;
  std::size_t index = 0;
  for (const CurvePanel* panel : panels) {
    std::string bands;
    std::string lines;
    labels.emplace_back();
    for (const Curve& curve : panel->curves) {
      const Drawn drawn = add_curve(curve, labels.back().size() + 1, width, axis.is_logarithmic,
                                    index, extent, plot);
      bands += drawn.band;
      lines += (lines.empty() ? "" : ", ") + drawn.line;
      labels.back().push_back(curve.label);
    }
    curves.push_back(bands + lines);
  }

  const bool same_labels = std::all_of(labels.begin(), labels.end(),
                                       [&](const auto& of_panel) { return of_panel == labels[0]; });
  PanelGrid grid;
  if (same_labels) grid.labels = labels.front();
  std::size_t next = 0;
  for (const auto& row : rows) {
    grid.rows.emplace_back();
    for (const CurvePanel& panel : row) {
      grid.rows.back().push_back(fmt::format(
          "  set title {}\n  set xlabel 'roll-out'; set ylabel {}\n  set xrange [0:{}]; set xtics "
          "{}\n  set yrange {}\n  {}\n  plot {}\n",
          literal(panel.title), literal(axis.title), length,
          round_step(static_cast<double>(length)), extent.range(axis.is_logarithmic),
          grid.labels.empty() ? "set key above horizontal Left reverse samplen 4" : "unset key",
          curves[next++]));
    }
  }
  arrange(grid, plot);
  return width;
}

std::vector<double> median_switches(const std::vector<MeasuredRun>& runs) {
  std::vector<std::vector<double>> by_switch;
  for (const MeasuredRun& run : runs) {
    if (by_switch.size() < run->switches.size()) by_switch.resize(run->switches.size());
    for (std::size_t i = 0; i < run->switches.size(); ++i) {
      by_switch[i].push_back(run->switches[i] + 1);
    }
  }
  std::vector<double> medians;
  for (const std::vector<double>& places : by_switch) medians.push_back(*median(places));
  return medians;
}

}  // namespace treeroll::report
