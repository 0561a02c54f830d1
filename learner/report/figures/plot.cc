#include "learner/report/figures/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace treeroll::report {
namespace {

// Okabe and Ito's colours, told apart by the colour-blind; the dashes tell them apart in grey.
constexpr const char* kLines = R"(  reset
  set linetype 1 lc rgb '#000000' lw 2 dt 1 pt 7
  set linetype 2 lc rgb '#0072B2' lw 2 dt (12,4) pt 5
  set linetype 3 lc rgb '#D55E00' lw 2 dt (3,3) pt 9
  set linetype 4 lc rgb '#009E73' lw 2 dt (12,3,3,3) pt 13
  set linetype 5 lc rgb '#CC79A7' lw 2 dt (6,6) pt 11
  set linetype 6 lc rgb '#E69F00' lw 2 dt (18,3) pt 4
  set linetype 7 lc rgb '#56B4E9' lw 2 dt (2,6) pt 6
  set linetype 8 lc rgb '#777777' lw 2 dt (12,3,3,3,3,3) pt 8
  set linetype cycle 8
  set border 3
  set tics nomirror out
  set grid lc rgb '#dddddd' lw 1 dt 1
)";

}  // namespace

std::string script_of(const Plot& plot) {
  // Picture points are 1/96 inch, as in SVG. PNG has 300 dots an inch, and all in it grows alike.
  constexpr double kPointsPerInch = 96;
  constexpr double kDotsPerPoint = 300 / kPointsPerInch;
  return fmt::format(
      "# gnuplot {0}.gp draws {0}.svg, {0}.png and {0}.pdf from {0}.dat\n"
      "set encoding utf8\n"
      "data = '{0}.dat'\n"
      "do for [format in 'svg png pdf'] {{\n"
      "  if (format eq 'svg') {{\n"
      "    set terminal svg noenhanced size {1},{2} font 'sans,13' background rgb 'white'\n"
      "  }}\n"
      "  if (format eq 'png') {{\n"
      "    set terminal pngcairo noenhanced size {3:.0f},{4:.0f} font 'sans,9.75' fontscale {5} "
      "linewidth {5} pointscale {5} background rgb 'white'\n"
      "  }}\n"
      "  if (format eq 'pdf') {{\n"
      "    set terminal pdfcairo noenhanced size {6:.4f},{7:.4f} font 'sans,9.75' linewidth 1 "
      "background rgb 'white'\n"
      "  }}\n"
      "  set output '{0}.'.format\n"
      "{8}{9}"
      "  set output\n"
      "}}\n",
      plot.id, plot.width_px, plot.height_px, plot.width_px * kDotsPerPoint,
      plot.height_px * kDotsPerPoint, kDotsPerPoint, plot.width_px / kPointsPerInch,
      plot.height_px / kPointsPerInch, kLines, plot.commands);
}

std::string literal(std::string_view text) {
  std::string text_literal = "'";
  for (const char c : text) {
    if (c == '\'') text_literal += "''";
    // gnuplot counts braces and reads line ends even within a literal of a block.
    else if (c == '{')
      text_literal += '(';
    else if (c == '}')
      text_literal += ')';
    else if (static_cast<unsigned char>(c) < ' ' || c == '\x7f' || c == '\\')
      text_literal += ' ';
    else
      text_literal += c;
  }
  return text_literal + "'";
}

std::string datum(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "NaN"; }

void name_page(const std::string& id, std::size_t page, std::size_t num_pages, Plot& plot) {
  plot.id = page == 0 ? id : fmt::format("{}_page_{}", id, page + 1);
  if (num_pages > 1) plot.title += fmt::format(", page {} of {}", page + 1, num_pages);
}

double round_step(double span) {
  constexpr double kStepsMax = 6;
  const double least = span / kStepsMax;
  const double decade = std::pow(10., std::floor(std::log10(least)));
  for (const double digit : {1., 2., 5.}) {
    if (digit * decade >= least * (1 - 1e-9)) return digit * decade;
  }
  return 10 * decade;
}

std::size_t num_columns(std::size_t longest, std::size_t num_rows) {
  if (num_rows == 1) return longest == 1 ? 1 : longest <= 4 ? 2 : longest <= 9 ? 3 : 4;
  // The last line of a long row has as few gaps as can be.
  return longest <= 4 ? longest : longest <= 6 || longest == 9 ? 3 : 4;
}

void arrange(const PanelGrid& grid, Plot& plot) {
  constexpr int kKeyPx = 40;
  constexpr int kWidthMaxPx = 1320;
  std::size_t longest = 0;
  for (const auto& row : grid.rows) longest = std::max(longest, row.size());
  const std::size_t columns = num_columns(longest, grid.rows.size());
  std::size_t num_lines = 0;
  for (const auto& row : grid.rows) num_lines += (row.size() + columns - 1) / columns;
  const bool is_alone = longest == 1 && grid.rows.size() == 1;
  plot.width_px = is_alone ? 820 : std::min(480 * static_cast<int>(columns), kWidthMaxPx);
  plot.height_px = (is_alone ? 480 : grid.panel_height_px * static_cast<int>(num_lines)) + kKeyPx;
  const double key = static_cast<double>(kKeyPx) / plot.height_px;
  const double width = 1. / static_cast<double>(columns);
  const double height = (1 - key) / static_cast<double>(num_lines);

  plot.commands = "  set multiplot\n";
  std::size_t line = 0;  // from above; gnuplot's origin is below
  for (const auto& row : grid.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::size_t below = num_lines - 1 - line - i / columns;
      plot.commands += fmt::format("  set origin {:.6f},{:.6f}; set size {:.6f},{:.6f}\n",
                                   width * static_cast<double>(i % columns),
                                   height * static_cast<double>(below), width, height);
      plot.commands += row[i];
    }
    line += (row.size() + columns - 1) / columns;
  }
  if (!grid.labels.empty()) {
    std::string lines;
    for (std::size_t i = 0; i < grid.labels.size(); ++i) {
      if (grid.labels[i].empty()) continue;
      lines += fmt::format("{}NaN with lines lt {} title {}", lines.empty() ? "" : ", ", i + 1,
                           literal(grid.labels[i]));
    }
    plot.commands += fmt::format(
        "  set origin 0,{:.6f}; set size 1,{:.6f}\n"
        "  unset title; unset xlabel; unset ylabel; unset tics; unset border; unset grid\n"
        "  unset arrow; unset label; unset logscale\n"
        "  set key center center horizontal Left reverse samplen 4 maxrows 2\n"
        "  set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0\n"
        "  set xrange [0:1]; set yrange [0:1]\n  plot {}\n",
        1 - key, key, lines);
  }
  plot.commands += "  unset multiplot\n";
}

}  // namespace treeroll::report
