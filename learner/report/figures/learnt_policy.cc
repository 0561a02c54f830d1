#include "learner/report/figures/learnt_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "learner/report/figures/condition_grid.h"

namespace treeroll::report {

const Policy& after(const LearntPolicy& policy) {
  return policy.best ? *policy.best : *policy.start;
}

Eigen::Index dim_of(const LearntPolicy& policy) {
  return policy.start->input_dim() + policy.start->output_dim();
}

const RolloutTrace* trace_of(const LearntPolicy& policy) {
  for (const auto* rollout : {&policy.best_rollout, &policy.start_rollout}) {
    if (!*rollout) continue;
    const RolloutTrace& trace = (*rollout)->trace;
    if (trace.policy_inputs.size() == static_cast<std::size_t>(policy.start->input_dim()) &&
        trace.policy_outputs.size() == static_cast<std::size_t>(policy.start->output_dim())) {
      return &trace;
    }
  }
  return nullptr;
}

std::vector<std::string> traced_columns(const LearntPolicy& policy) {
  const RolloutTrace* trace = trace_of(policy);
  if (trace == nullptr) return {};
  std::vector<std::string> columns = trace->policy_inputs;
  columns.insert(columns.end(), trace->policy_outputs.begin(), trace->policy_outputs.end());
  return columns;
}

std::vector<std::string> names_of(const LearntPolicy& policy) {
  if (static_cast<Eigen::Index>(policy.columns.size()) == dim_of(policy)) return policy.columns;
  return traced_columns(policy);
}

std::string variable_title(const std::vector<std::string>& names, int input_dim,
                           Eigen::Index variable) {
  if (!names.empty()) return axis_title(names[static_cast<std::size_t>(variable)]);
  if (variable >= input_dim) return fmt::format("output {}", variable - input_dim + 1);
  return input_dim == 1 ? "input" : fmt::format("input {}", variable + 1);
}

std::string axes_of(const LearntPolicy& policy, Plane plane) {
  const std::vector<std::string> names = names_of(policy);
  const int input_dim = policy.start->input_dim();
  return axis_labels(variable_title(names, input_dim, plane.across),
                     variable_title(names, input_dim, plane.up));
}

std::string goal_line(const LearntPolicy& policy, Plane plane, const std::string& style,
                      DataSets& data) {
  const RolloutTrace* trace = trace_of(policy);
  if (trace == nullptr) return "";
  const std::vector<std::string> columns = traced_columns(policy);
  const auto wanted = [&](Eigen::Index variable) {
    const std::string& column = columns[static_cast<std::size_t>(variable)];
    return column_of(*trace, variable < policy.start->input_dim() ? column : goal_of(column));
  };
  const auto across = wanted(plane.across);
  const auto up = wanted(plane.up);
  if (!across || !up) return "";
  return fmt::format("data index {} using 1:2 with lines {} notitle, ",
                     add_curve("goal", *across, *up, data), style);
}

Range inputs_of(const LearntPolicy& policy) {
  if (const RolloutTrace* trace = trace_of(policy)) {
    const std::vector<double> inputs = *column_of(*trace, trace->policy_inputs.front());
    const auto [low, high] = std::minmax_element(inputs.begin(), inputs.end());
    if (!inputs.empty() && std::isfinite(*low) && *low < *high) return {*low, *high};
  }
  return policy.start->sketch().inputs.front();
}

std::vector<PolicyRows> policy_pages(const std::vector<const LearntPolicy*>& policies) {
  return pages_of_rows(rows_by(
      policies, [](const LearntPolicy* policy) { return shared_parts(policy->condition); }));
}

std::string output_id(const std::string& id, Eigen::Index output) {
  return output == 1 ? id : fmt::format("{}_output_{}", id, output);
}

}  // namespace treeroll::report
