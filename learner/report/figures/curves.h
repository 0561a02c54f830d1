#pragma once

#include <string>
#include <vector>

#include "learner/report/figures/condition_grid.h"
#include "learner/report/figures/plot.h"
#include "learner/report/statistics/sample.h"

namespace treeroll::report {

/// What one condition came to over its roll-outs.
struct Curve {
  std::string label;
  std::vector<std::vector<double>> repetitions;  ///< by roll-out; NaN where there is nothing
  std::vector<double> switches = {};  ///< roll-outs, from 1, at which layers were left: the median
};

struct CurvePanel {
  std::string title;
  std::vector<Curve> curves;
};

struct CurveAxis {
  std::string title;
  bool is_logarithmic = false;  ///< means and intervals are then of the logarithms
};

/// Sets data, commands and size: means over repetitions with their 95 % intervals, a mark at each
/// switch. Precondition: panels that are not empty; positive values on a logarithmic axis.
/// @return  over how many roll-outs a point is a mean
std::size_t draw_curves(const Rows<CurvePanel>& rows, const CurveAxis& axis, Plot& plot);

/// The medians of the first, second, ... switch of the runs, counted from 1.
std::vector<double> median_switches(const std::vector<MeasuredRun>& runs);

}  // namespace treeroll::report
