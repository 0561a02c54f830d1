#include "learner/report/figures/motion_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "learner/report/figures/data_sets.h"

namespace treeroll::report {
namespace {

constexpr std::size_t kInstants = 10;
/// Between two instants.
constexpr std::size_t kGhosts = 3;
constexpr std::size_t kConditionsPerPage = 4;
constexpr int kWidthPx = 1320;
constexpr int kSidePx = 15;
constexpr int kTextPx = 55;   ///< above and below a strip
constexpr int kTimesPx = 28;  ///< of these below, so that the times are not cut off
constexpr int kStripPxMin = 60;
constexpr int kStripPxMax = 400;

using PoseLines = std::vector<std::vector<double>>;

struct Strip {
  std::string title;
  RolloutTrace trace;             ///< its first roll-out, thinned
  std::vector<std::size_t> rows;  ///< the instants: drawn black
};

/// Calls `see` with what was seen from after the instant before up to this one.
template <class Visitor>
void visit_poses(const Strip& strip, std::size_t instant, const Visitor& see) {
  const std::size_t first = instant == 0 ? strip.rows[0] : strip.rows[instant - 1] + 1;
  for (std::size_t row = first; row <= strip.rows[instant]; ++row) see(strip.trace.poses[row]);
}

void include(double value, Range& range) {
  if (!std::isfinite(value)) return;
  range.low = std::min(range.low, value);
  range.high = std::max(range.high, value);
}

void include(const PoseLines& pose, Range& across, Range& up) {
  for (const auto& line : pose) {
    for (std::size_t i = 0; i + 1 < line.size(); i += 2) {
      include(line[i], across);
      include(line[i + 1], up);
    }
  }
}

/// How strips are laid out that share one scale.
struct Layout {
  Range across;        ///< of a strip; x = 0 of its first instant is 0
  Range up;            ///< with some air around
  double spacing = 0;  ///< from x = 0 of an instant to that of the next: none touches its neighbour

  double width() const { return across.high - across.low; }
  double height() const { return up.high - up.low; }
};

Layout layout_of(const std::vector<Strip>& strips) {
  constexpr double kAir = .05;
  constexpr double kReachMinM = 1e-6;
  Layout layout;
  double reach = 0;
  std::vector<std::vector<Range>> extents;  // by strip and instant; x = 0 is within each
  for (const Strip& strip : strips) {
    extents.emplace_back();
    for (std::size_t i = 0; i < strip.rows.size(); ++i) {
      Range across;
      visit_poses(strip, i, [&](const PoseLines& pose) { include(pose, across, layout.up); });
      if (i > 0) {
        layout.spacing = std::max(layout.spacing, extents.back().back().high - across.low);
      }
      reach = std::max(reach, across.high - across.low);
      extents.back().push_back(across);
    }
  }
  const double air = kAir * std::max({reach, layout.height(), kReachMinM});
  layout.spacing += 2 * air;
  for (const auto& of_strip : extents) {
    for (std::size_t i = 0; i < of_strip.size(); ++i) {
      const double shift = static_cast<double>(i) * layout.spacing;
      include(of_strip[i].low + shift, layout.across);
      include(of_strip[i].high + shift, layout.across);
    }
  }
  for (Range* range : {&layout.across, &layout.up}) {
    range->low -= air;
    range->high += air;
  }
  return layout;
}

void add_pose(const PoseLines& pose, double shift, DataSets& data) {
  for (const auto& line : pose) {
    for (std::size_t i = 0; i + 1 < line.size(); i += 2) data.add(line[i] + shift, line[i + 1]);
    data.interrupt();
  }
}

/// From where an instant's time is written to the lowest point seen then, for a plant may go far.
void add_leader(const PoseLines& pose, double shift, double bottom, DataSets& data) {
  double lowest = std::numeric_limits<double>::infinity();
  double across = 0;
  for (const auto& line : pose) {
    for (std::size_t i = 0; i + 1 < line.size(); i += 2) {
      if (!std::isfinite(line[i]) || !(line[i + 1] < lowest)) continue;
      across = line[i];
      lowest = line[i + 1];
    }
  }
  if (!std::isfinite(lowest)) return;
  data.add(shift, bottom);
  data.add(across + shift, lowest);
  data.interrupt();
}

std::vector<std::size_t> instants(std::size_t num_rows) {
  const std::size_t count = std::min(num_rows, kInstants);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.push_back(count == 1 ? 0 : i * (num_rows - 1) / (count - 1));
  }
  return rows;
}

std::string strip_commands(const Strip& strip, const Layout& layout, DataSets& data) {
  const RolloutTrace& trace = strip.trace;
  const auto shift = [&](std::size_t i) { return static_cast<double>(i) * layout.spacing; };
  data.begin("across up: between the instants");
  for (std::size_t i = 1; i < strip.rows.size(); ++i) {
    visit_poses(strip, i, [&](const PoseLines& pose) { add_pose(pose, shift(i), data); });
  }
  // A set without a point would not be counted.
  data.add(std::numeric_limits<double>::quiet_NaN(), 0);
  const int ghosts = data.end();
  data.begin("across up: at the instants");
  std::string times;
  for (std::size_t i = 0; i < strip.rows.size(); ++i) {
    add_pose(trace.poses[strip.rows[i]], shift(i), data);
    const double time = trace.numbers[strip.rows[i] * trace.columns.size()];
    times += fmt::format("{}{} {:.6g}", i == 0 ? "" : ", ", literal(fmt::format("{:.2f}", time)),
                         shift(i));
  }
  data.add(std::numeric_limits<double>::quiet_NaN(), 0);
  const int seen = data.end();
  data.begin("across up: from the times to what is seen");
  for (std::size_t i = 0; i < strip.rows.size(); ++i) {
    add_leader(trace.poses[strip.rows[i]], shift(i), layout.up.low, data);
  }
  data.add(std::numeric_limits<double>::quiet_NaN(), 0);
  const int leaders = data.end();
  return fmt::format(
      "  set label 1 {} at graph 0, graph 1.1 left\n  set xtics ({})\n"
      "  set xrange [{:.6g}:{:.6g}]; set yrange [{:.6g}:{:.6g}]\n"
      "  plot data index {} using 1:2 with lines lc rgb '#bbbbbb' lw 1 dt 1 notitle, "
      "data index {} using 1:2 with lines lc rgb '#0072B2' lw 1 dt (2,4) notitle, "
      "data index {} using 1:2 with lines lc rgb '#000000' lw 2 dt 1 notitle\n",
      literal(strip.title), times, layout.across.low, layout.across.high, layout.up.low,
      layout.up.high, ghosts, leaders, seen);
}

/// Whether anything can be seen.
bool has_motion(const std::optional<ShownRollout>& rollout) {
  if (!rollout) return false;
  for (const auto& pose : rollout->trace.poses) {
    for (const auto& line : pose) {
      if (std::any_of(line.begin(), line.end(), [](double at) { return std::isfinite(at); })) {
        return true;
      }
    }
  }
  return false;
}

Strip strip_of(const std::string& name, const ShownRollout& rollout) {
  Strip strip{.title = rollout.status == "ok"
                           ? fmt::format("{}, reward {:.3f}", name, rollout.reward)
                           : fmt::format("{}, {}", name, rollout.status),
              .trace = thinned(rollout.trace, (kInstants - 1) * (kGhosts + 1) + 1),
              .rows = {}};
  strip.rows = instants(strip.trace.num_rows());
  return strip;
}

/// A condition's strips and how they are laid out.
struct Scene {
  std::vector<Strip> strips;
  Layout layout;
  int strip_px = 0;  ///< height of each, without its text
};

Scene scene_of(const LearntPolicy& policy) {
  Scene scene;
  for (const auto& [word, rollout] :
       {std::pair{"start", &policy.start_rollout}, std::pair{"best", &policy.best_rollout}}) {
    if (has_motion(*rollout)) {
      scene.strips.push_back(strip_of(policy.condition + ": " + word, **rollout));
    }
  }
  scene.layout = layout_of(scene.strips);
  for (Strip& strip : scene.strips) {
    strip.title += fmt::format(", {:.2g} m from line to line", scene.layout.spacing);
  }
  // Clamped before it becomes an integer: a simulation on its way to diverging goes far.
  scene.strip_px = static_cast<int>(
      std::clamp((kWidthPx - 2 * kSidePx) * scene.layout.height() / scene.layout.width(),
                 1. * kStripPxMin, 1. * kStripPxMax));
  return scene;
}

Plot motion_page(const std::vector<const LearntPolicy*>& policies) {
  std::vector<Scene> scenes;
  Plot plot;
  plot.width_px = kWidthPx;
  plot.height_px = 0;
  for (const LearntPolicy* policy : policies) {
    scenes.push_back(scene_of(*policy));
    plot.height_px +=
        static_cast<int>(scenes.back().strips.size()) * (scenes.back().strip_px + kTextPx);
  }
  plot.commands =
      "  set multiplot\n  unset key; unset border; unset grid\n  set tics scale 0\n  unset ytics\n"
      "  set grid xtics lc rgb '#cccccc' lw 1 dt 1\n  set size ratio -1\n";
  DataSets data;
  const double side = static_cast<double>(kSidePx) / kWidthPx;
  double top_px = plot.height_px;  // gnuplot counts from below
  for (const Scene& scene : scenes) {
    for (const Strip& strip : scene.strips) {
      const double bottom_px = top_px - scene.strip_px - kTextPx;
      plot.commands += fmt::format(
          "  set lmargin at screen {:.6f}; set rmargin at screen {:.6f}\n"
          "  set bmargin at screen {:.6f}; set tmargin at screen {:.6f}\n",
          side, 1 - side, (bottom_px + kTimesPx) / plot.height_px,
          (top_px - (kTextPx - kTimesPx)) / plot.height_px);
      plot.commands += strip_commands(strip, scene.layout, data);
      top_px = bottom_px;
    }
  }
  plot.commands += "  unset multiplot\n";
  plot.data = data.take();
  plot.caption = fmt::format(
      "What is seen at the instants written below, {}, in black, and in grey since the instant "
      "before; what learning began with, and the best policy of all repetitions. The vertical "
      "lines "
      "are at x = 0 of each instant; dotted lines lead from a time to what is seen then. The "
      "strips "
      "of a condition have one scale, across and upwards.",
      axis_title(scenes.front().strips.front().trace.columns.front()));
  return plot;
}

}  // namespace

std::vector<Plot> motion_plots(const std::string& study,
                               const std::vector<LearntPolicy>& policies) {
  std::vector<const LearntPolicy*> moving;
  for (const LearntPolicy& policy : policies) {
    if (has_motion(policy.start_rollout) || has_motion(policy.best_rollout)) {
      moving.push_back(&policy);
    }
  }
  const auto pages = pages_of(moving, kConditionsPerPage);
  std::vector<Plot> plots;
  for (std::size_t page = 0; page < pages.size(); ++page) {
    Plot plot = motion_page(pages[page]);
    plot.title = "Motion in " + study + " before and after learning";
    name_page("motion", page, pages.size(), plot);
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace treeroll::report
