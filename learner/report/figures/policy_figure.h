#pragma once

#include <string>
#include <vector>

#include "learner/report/figures/learnt_policy.h"
#include "learner/report/figures/plot.h"

namespace treeroll::report {

/// What a panel shows over what.
struct View {
  Plane plane;
  bool is_path = false;  ///< one output over the other, to one scale
};

/// A figure of policies of one input: a panel a condition, above the goal or below it.
class PolicyFigure {
 public:
  PolicyFigure() = default;
  PolicyFigure(const PolicyFigure&) = delete;
  PolicyFigure& operator=(const PolicyFigure&) = delete;
  virtual ~PolicyFigure() = default;

  /// Commands that set line types, before all panels.
  virtual std::string line_types() const = 0;
  /// Of the goal, as gnuplot has it.
  virtual std::string goal_style() const = 0;
  virtual std::string panel_title(const LearntPolicy& policy) const = 0;
  /// The range of the input's axis, as gnuplot has it.
  virtual std::string input_range(const LearntPolicy& policy) const = 0;
  /// The plot command of a panel.
  /// @param goal  the goal's part of it, ending in ", "; empty without one
  virtual std::string lines(const LearntPolicy& policy, const View& view, const std::string& goal,
                            DataSets& data) const = 0;
  /// Of lines 1, 2, ..
  virtual std::vector<std::string> labels(const PolicyRows& rows, bool has_goal) const = 0;
  virtual std::string caption(const PolicyRows& rows, const View& view, bool has_goal) const = 0;
};

/// A page or more for each output over the input. Policies of several inputs are left out.
/// @param id, title  of the first page; further outputs are counted
std::vector<Plot> draw_outputs(const std::vector<LearntPolicy>& policies,
                               const PolicyFigure& figure, const std::string& id,
                               const std::string& title);

/// Pages of the paths of policies of two outputs.
std::vector<Plot> draw_paths(const std::vector<LearntPolicy>& policies, const PolicyFigure& figure,
                             const std::string& id, const std::string& title);

}  // namespace treeroll::report
