#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace treeroll::report {

/// One figure: numbers and the gnuplot commands that draw them. Nothing is drawn in this room.
struct Plot {
  std::string id = {};        ///< file name without an end: letters, digits, '-' and '_'
  std::string title = {};     ///< in words
  std::string caption = {};   ///< what is drawn, over what, of how many
  std::string data = {};      ///< columns for `plot data`; data sets apart by two empty lines
  std::string commands = {};  ///< from titles and axes to the last `plot`; `data` names the file
  int width_px = 900;
  int height_px = 500;
};

/// The whole script: `gnuplot ID.gp` beside ID.dat draws ID.svg, ID.png (300 dots an inch) and
/// ID.pdf.
std::string script_of(const Plot& plot);

/// Text as a gnuplot literal that nothing in it can end: names of conditions are a user's.
std::string literal(std::string_view text);

/// A number for a data file; what is not finite leaves a gap.
std::string datum(double value);

/// The distance of marks on an axis: 1, 2 or 5 times a power of ten, so that `span` has about five.
/// Precondition: a span that is positive and finite.
double round_step(double span);

/// More panels than these go to another page.
inline constexpr std::size_t kPanelsPerPage = 12;

template <class T>
std::vector<std::vector<T>> pages_of(const std::vector<T>& all, std::size_t size) {
  std::vector<std::vector<T>> pages;
  for (const T& item : all) {
    if (pages.empty() || pages.back().size() == size) pages.emplace_back();
    pages.back().push_back(item);
  }
  return pages;
}

/// Panels that belong beside each other: none of another row stands among them.
template <class T>
using Rows = std::vector<std::vector<T>>;

/// How many panels of rows of these lengths stand beside each other. One row alone has lines as its
/// number of panels suggests.
/// @param longest  of the lengths
std::size_t num_columns(std::size_t longest, std::size_t num_rows);

/// Panels by page. A row begins a line of its own and stays on its page if a page can hold it. Rows
/// of one panel each are one row together: nothing is beside anything.
template <class T>
std::vector<Rows<T>> pages_of_rows(Rows<T> rows) {
  constexpr std::size_t kLinesPerPage = 5;
  std::size_t longest = 0;
  for (const auto& row : rows) longest = std::max(longest, row.size());
  if (longest == 0) return {};
  if (longest == 1) {
    for (std::size_t i = 1; i < rows.size(); ++i) rows[0].push_back(std::move(rows[i].front()));
    rows.resize(1);
  }
  const std::size_t columns = num_columns(std::min(longest, kPanelsPerPage), rows.size());
  const std::size_t lines_max = std::min(kLinesPerPage, kPanelsPerPage / columns);
  std::vector<Rows<T>> pages;
  std::size_t num_lines = 0;
  for (const auto& whole : rows) {
    for (std::vector<T>& row : pages_of(whole, kPanelsPerPage)) {
      const std::size_t lines = (row.size() + columns - 1) / columns;
      if (pages.empty() || num_lines + lines > lines_max) {
        pages.emplace_back();
        num_lines = 0;
      }
      num_lines += lines;
      pages.back().push_back(std::move(row));
    }
  }
  return pages;
}

/// The id and the title of a page, counted from 0: the first has the id itself.
void name_page(const std::string& id, std::size_t page, std::size_t num_pages, Plot& plot);

/// What learning began with is line 2 in grey, what a task wants line 9, thick and light: before
/// the commands of plots that have them.
inline constexpr const char* kStartAndGoalLines =
    "  set linetype 2 lc rgb '#888888' lw 2 dt (6,4)\n"
    "  set linetype 9 lc rgb '#F3CC78' lw 7 dt 1\n";

/// Panels in a grid below a strip for the key.
struct PanelGrid {
  Rows<std::string> rows;  ///< commands of each panel, from title and axes to a plot
  /// Of lines 1, 2, ..; an empty one is not shown. Empty: the panels have keys of their own.
  std::vector<std::string> labels = {};
  int panel_height_px = 300;
};

/// Sets commands and size of a plot of one panel or several.
void arrange(const PanelGrid& grid, Plot& plot);

}  // namespace treeroll::report
