#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace treeroll {

/// One figure: numbers and the gnuplot commands that draw them. Nothing is drawn in this room.
struct Plot {
  std::string id;             ///< file name without an end: letters, digits, '-' and '_'
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

/// Panels in a grid below a strip for the key.
struct PanelGrid {
  std::vector<std::string> commands;  ///< each from title and axes to a plot
  std::vector<std::string> labels;  ///< of lines 1, 2, ..; empty: the panels have keys of their own
  int panel_height_px = 300;
};

/// Sets commands and size of a plot of one panel or several.
void arrange(const PanelGrid& grid, Plot& plot);

}  // namespace treeroll
