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
  return fmt::format(
      "# gnuplot {0}.gp draws {0}.svg and {0}.png from {0}.dat\n"
      "set encoding utf8\n"
      "data = '{0}.dat'\n"
      "do for [format in 'svg png'] {{\n"
      "  if (format eq 'svg') {{\n"
      "    set terminal svg noenhanced size {1},{2} font 'sans,13' background rgb 'white'\n"
      "  }} else {{\n"
      "    set terminal pngcairo noenhanced size {1},{2} font 'sans,11' background rgb 'white'\n"
      "  }}\n"
      "  set output '{0}.'.format\n"
      "{3}{4}"
      "  set output\n"
      "}}\n",
      plot.id, plot.width_px, plot.height_px, kLines, plot.commands);
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

void arrange(const PanelGrid& grid, Plot& plot) {
  constexpr int kKeyPx = 40;
  constexpr int kWidthMaxPx = 1320;
  const int num_panels = static_cast<int>(grid.commands.size());
  const int num_columns = num_panels == 1 ? 1 : num_panels <= 4 ? 2 : num_panels <= 9 ? 3 : 4;
  const int num_rows = (num_panels + num_columns - 1) / num_columns;
  plot.width_px = num_panels == 1 ? 820 : std::min(480 * num_columns, kWidthMaxPx);
  plot.height_px = (num_panels == 1 ? 480 : grid.panel_height_px * num_rows) + kKeyPx;
  const double key = static_cast<double>(kKeyPx) / plot.height_px;
  const double width = 1. / num_columns;
  const double height = (1 - key) / num_rows;

  plot.commands = "  set multiplot\n";
  for (int i = 0; i < num_panels; ++i) {
    const int column = i % num_columns;
    const int row = i / num_columns;  // from above; gnuplot's origin is below
    plot.commands += fmt::format("  set origin {:.6f},{:.6f}; set size {:.6f},{:.6f}\n",
                                 width * column, height * (num_rows - 1 - row), width, height);
    plot.commands += grid.commands[static_cast<std::size_t>(i)];
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
