#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "learner/report/figures/data_sets.h"
#include "learner/report/figures/plot.h"
#include "learner/report/figures/shown_trace.h"

namespace treeroll::report {

/// What a condition began with, and what it has come to.
struct LearntPolicy {
  std::string condition;
  PolicyPtr start;
  PolicyPtr best = {};                    ///< of the best roll-out of all repetitions; null: none
  std::vector<PolicyPtr> solutions = {};  ///< the best of each repetition that has one
  /// Inputs, then outputs, as the demonstration names them; empty: it does not.
  std::vector<std::string> columns = {};
  std::optional<ShownRollout> start_rollout = {};  ///< of `start`, if a worker executable made it
  std::optional<ShownRollout> best_rollout = {};   ///< of `best`
};

/// The best, or the start where nothing was learnt.
const Policy& after(const LearntPolicy& policy);

/// Inputs and outputs together.
Eigen::Index dim_of(const LearntPolicy& policy);

/// A roll-out of it, the best if there is one, that has columns for all its variables; else null.
const RolloutTrace* trace_of(const LearntPolicy& policy);

/// The columns of its variables in trace_of(): inputs, then outputs. Empty without a trace.
std::vector<std::string> traced_columns(const LearntPolicy& policy);

/// Its variables by name: the demonstration's names, else the task's; empty without either.
std::vector<std::string> names_of(const LearntPolicy& policy);

/// The title of a variable's axis by names_of(), or "input", "input 2", "output 1".
std::string variable_title(const std::vector<std::string>& names, int input_dim,
                           Eigen::Index variable);

/// `set xlabel X; set ylabel Y` for a plane of its variables, as a line.
std::string axes_of(const LearntPolicy& policy, Plane plane);

/// What the task wants of the plane's variables; the input is what it is.
/// @param style  of the line, as gnuplot has it
/// @return       its part of a plot command, ending in ", "; empty without a goal
std::string goal_line(const LearntPolicy& policy, Plane plane, const std::string& style,
                      DataSets& data);

/// The inputs that the task gives it, of a policy of one input; without a trace those at which its
/// start is to be seen.
Range inputs_of(const LearntPolicy& policy);

/// By page, those on one line whose conditions share all but the last part of their names.
using PolicyRows = Rows<const LearntPolicy*>;
std::vector<PolicyRows> policy_pages(const std::vector<const LearntPolicy*>& policies);

/// Of a figure of one output of several: "policies", "policies_output_2".
std::string output_id(const std::string& id, Eigen::Index output);

}  // namespace treeroll::report
