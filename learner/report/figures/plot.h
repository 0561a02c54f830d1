#pragma once

#include <string>
#include <string_view>
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

/// The whole script: `gnuplot ID.gp` beside ID.dat draws ID.svg and ID.png.
std::string script_of(const Plot& plot);

/// Text as a gnuplot literal that nothing in it can end: names of conditions are a user's.
std::string literal(std::string_view text);

/// A number for a data file; what is not finite leaves a gap.
std::string datum(double value);

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

/// The id and the title of a page, counted from 0: the first has the id itself.
void name_page(const std::string& id, std::size_t page, std::size_t num_pages, Plot& plot);

/// What learning began with is line 2 in grey, what a task wants line 9, thick and light: before
/// the commands of plots that have them.
inline constexpr const char* kStartAndGoalLines =
    "  set linetype 2 lc rgb '#888888' lw 2 dt (6,4)\n"
    "  set linetype 9 lc rgb '#F3CC78' lw 7 dt 1\n";

/// Panels in a grid below a strip for the key.
struct PanelGrid {
  std::vector<std::string> commands;  ///< each from title and axes to a plot
  /// Of lines 1, 2, ..; an empty one is not shown. Empty: the panels have keys of their own.
  std::vector<std::string> labels;
  int panel_height_px = 300;
};

/// Sets commands and size of a plot of one panel or several.
void arrange(const PanelGrid& grid, Plot& plot);

}  // namespace treeroll::report
